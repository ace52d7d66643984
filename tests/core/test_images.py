"""Reading images: luminance and alpha."""

import sys

import numpy as np
import pytest

from demsmith.core.errors import DependencyError, InputError
from demsmith.core.images import read_image

oiio = pytest.importorskip("OpenImageIO", reason="OpenImageIO is missing")

RED, GREEN, BLUE = 0.2126, 0.7152, 0.0722


OIIO_TYPES = {
    "uint8": "uint8", "uint16": "uint16", "uint32": "uint", "float16": "half",
    "float32": "float", "float64": "double",
}  # fmt: skip


def make_image(path, pixels, *, names=None, attributes=()):
    """Write an image by OpenImageIO itself; returns the path as text."""
    pixels = np.atleast_3d(pixels)
    rows, columns, channels = pixels.shape
    spec = oiio.ImageSpec(columns, rows, channels, OIIO_TYPES[str(pixels.dtype)])
    if names:
        spec.channelnames = names
    spec.attribute("oiio:UnassociatedAlpha", 1)
    for name, value in attributes:
        spec.attribute(name, value)
    out = oiio.ImageOutput.create(str(path))
    assert out.open(str(path), spec), out.geterror()
    assert out.write_image(np.ascontiguousarray(pixels)), out.geterror()
    out.close()
    return str(path)


@pytest.mark.parametrize(
    ("name", "dtype"),
    [
        ("a.png", np.uint8),
        ("a.png", np.uint16),
        ("a.tif", np.uint8),
        ("a.tif", np.uint16),
        ("a.tif", np.uint32),
    ],
)
def test_integers_are_scaled_by_their_range(tmp_path, name, dtype):
    top = np.iinfo(dtype).max
    grey = np.linspace(0, top, 12).astype(dtype).reshape(3, 4)
    luminance, alpha = read_image(make_image(tmp_path / name, grey))
    assert luminance.dtype == np.float64
    np.testing.assert_array_equal(luminance, grey / np.float64(top))
    assert alpha is None


@pytest.mark.parametrize(
    ("name", "dtype"),
    [("a.exr", np.float32), ("a.exr", np.float16), ("a.tif", np.float32), ("a.tif", np.float64)],
)
def test_floats_stay(tmp_path, name, dtype):
    grey = np.array([[-2.5, 0, 1.5], [1000, 0.25, 7]], dtype=dtype)
    spec = dict(names=("Y",)) if name.endswith("exr") else {}
    luminance, alpha = read_image(make_image(tmp_path / name, grey, **spec))
    np.testing.assert_array_equal(luminance, grey)
    assert alpha is None


def test_colour_is_rec_709_luminance(tmp_path):
    colours = np.eye(3, dtype=np.uint8).reshape(1, 3, 3) * 255
    luminance, alpha = read_image(make_image(tmp_path / "a.png", colours))
    np.testing.assert_allclose(luminance, [[RED, GREEN, BLUE]])
    assert alpha is None
    white = np.full((2, 2, 3), 65535, dtype=np.uint16)
    np.testing.assert_allclose(read_image(make_image(tmp_path / "b.png", white))[0], 1)


def test_jpeg(tmp_path):
    grey = np.full((16, 16, 3), 100, dtype=np.uint8)
    luminance, _ = read_image(make_image(tmp_path / "a.jpg", grey))
    np.testing.assert_allclose(luminance, 100 / 255, atol=2 / 255)


@pytest.mark.parametrize("name", ["a.png", "a.tif"])
def test_alpha_leaves_luminance_alone(tmp_path, name):
    pixels = np.array([[[200, 200, 200, 255], [200, 200, 200, 51], [80, 80, 80, 0]]], np.uint8)
    luminance, alpha = read_image(make_image(tmp_path / name, pixels))
    np.testing.assert_allclose(alpha, [[1, 0.2, 0]])
    np.testing.assert_allclose(luminance, [[200 / 255, 200 / 255, 80 / 255]])


def test_grey_with_alpha(tmp_path):
    pixels = np.array([[[200, 255], [100, 51]]], np.uint8)
    path = make_image(tmp_path / "a.png", pixels, names=("Y", "A"))
    luminance, alpha = read_image(path)
    np.testing.assert_allclose(luminance, [[200 / 255, 100 / 255]])
    np.testing.assert_allclose(alpha, [[1, 0.2]])


def test_alpha_multiplied_in_is_divided_out(tmp_path):
    """EXR stores colour times alpha."""
    pixels = np.array([[[0.4, 0.4, 0.4, 0.5], [0, 0, 0, 0]]], np.float32)
    luminance, alpha = read_image(make_image(tmp_path / "a.exr", pixels))
    np.testing.assert_allclose(luminance, [[0.8, 0]], rtol=1e-6)
    np.testing.assert_allclose(alpha, [[0.5, 0]])


# Where the pixel that the tag calls the top left one is stored (Exif 2.3, 4.6.4 A, Orientation).
@pytest.mark.parametrize(
    ("orientation", "stored"),
    [
        (1, [[1, 2, 3], [4, 5, 6]]),
        (2, [[3, 2, 1], [6, 5, 4]]),
        (3, [[6, 5, 4], [3, 2, 1]]),
        (4, [[4, 5, 6], [1, 2, 3]]),
        (5, [[1, 4], [2, 5], [3, 6]]),
        (6, [[3, 6], [2, 5], [1, 4]]),
        (7, [[6, 3], [5, 2], [4, 1]]),
        (8, [[4, 1], [5, 2], [6, 3]]),
    ],
)
def test_orientation(tmp_path, orientation, stored):
    path = make_image(
        tmp_path / "a.tif", np.uint8(stored), attributes=[("Orientation", orientation)]
    )
    luminance, _ = read_image(path)
    np.testing.assert_allclose(luminance * 255, [[1, 2, 3], [4, 5, 6]])


def test_bad_files(tmp_path):
    with pytest.raises(InputError, match="does not exist"):
        read_image(tmp_path / "none.png")
    with pytest.raises(InputError, match="no file"):
        read_image(tmp_path)
    for name in ("a.png", "a.txt", "a.exr"):
        (tmp_path / name).write_text("no image")
        with pytest.raises(InputError, match=rf"{name}' cannot be read as an image: ."):
            read_image(tmp_path / name)
    (tmp_path / "empty.png").touch()
    with pytest.raises(InputError, match="cannot be read as an image"):
        read_image(tmp_path / "empty.png")


@pytest.mark.parametrize("name", ["a.png", "a.tif", "a.jpg", "a.exr"])
def test_truncated(tmp_path, name):
    noise = np.random.default_rng(1).random((64, 64, 3)).astype(np.float32)
    pixels = noise if name.endswith("exr") else (noise * 255).astype(np.uint8)
    path = make_image(tmp_path / name, pixels)
    data = (tmp_path / name).read_bytes()
    (tmp_path / name).write_bytes(data[: len(data) // 2])
    with pytest.raises(InputError, match=name):
        read_image(path)


def test_too_large(tmp_path, monkeypatch):
    monkeypatch.setattr("demsmith.core.images._MOST_PIXELS", 11)
    path = make_image(tmp_path / "a.png", np.zeros((3, 4), np.uint8))
    with pytest.raises(InputError, match="4 × 3 pixels"):
        read_image(path)


def test_openimageio_missing(tmp_path, monkeypatch):
    path = make_image(tmp_path / "a.png", np.zeros((3, 4), np.uint8))
    monkeypatch.setitem(sys.modules, "OpenImageIO", None)
    with pytest.raises(DependencyError, match="pip install openimageio"):
        read_image(path)

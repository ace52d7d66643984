"""Pictures and numbers: reading an image of any kind, encoding a JPEG, by OpenImageIO."""

import os
import tempfile

import numpy as np

from demsmith.core.errors import DependencyError, InputError, OutputError

REC_709 = (0.2126, 0.7152, 0.0722)
"""Shares of red, green and blue in luminance (ITU-R BT.709-6, section 3)."""

_MOST_PIXELS = 1 << 31
_JPEG_QUALITY = 88


def read_image(path):
    """Read the luminance of an image.

    Parameters
    ----------
    path : str or path-like
        Any image OpenImageIO reads: PNG, JPEG, TIFF, EXR and others. The first of several in a
        file is read, turned as its orientation tag says.

    Returns
    -------
    luminance : ndarray of float64, shape (H, W)
        Grey, or the Rec. 709 luminance of red, green and blue as they are stored: gamma is not
        undone. Integers are divided by the greatest of their type, so that they are 0 to 1;
        floats stay as they are. It is not multiplied by alpha.
    alpha : ndarray of float64, shape (H, W), or None
        Opacity, 0 to 1, if the image has it.

    Raises
    ------
    InputError
        If the file is missing, no image, damaged, or too large.
    DependencyError
        If OpenImageIO is missing.
    """
    path = os.fspath(path)
    if not os.path.isfile(path):
        raise InputError(f"'{path}' does not exist, or is no file")
    pixels, spec = _read_pixels(_load(), path)
    alpha = None if spec.alpha_channel < 0 else pixels[:, :, spec.alpha_channel]
    colours = [
        pixels[:, :, number]
        for number in range(spec.nchannels)
        if number not in (spec.alpha_channel, spec.z_channel)
    ]
    if not colours:
        raise InputError(f"'{path}' has no grey or colour channel")
    luminance = sum(map(np.multiply, REC_709, colours)) if len(colours) >= 3 else colours[0]
    if alpha is not None and not spec.get_int_attribute("oiio:UnassociatedAlpha"):
        luminance = np.divide(luminance, alpha, out=np.zeros_like(luminance), where=alpha > 0)
    return np.ascontiguousarray(luminance), alpha


def encode_jpeg(picture):
    """Encode a picture as a JPEG whose colours are as sharp as its brightness.

    Parameters
    ----------
    picture : (H, W, 3) uint8 array
        Red, green and blue.

    Returns
    -------
    bytes

    Raises
    ------
    OutputError
        If there is no room for it in the folder of temporary files.
    DependencyError
        If OpenImageIO is missing.
    """
    oiio = _load()
    rows, columns, channels = picture.shape
    spec = oiio.ImageSpec(columns, rows, channels, "uint8")
    spec.attribute("Compression", f"jpeg:{_JPEG_QUALITY}")
    spec.attribute("jpeg:subsampling", "4:4:4")
    try:
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "picture.jpg")
            image = oiio.ImageOutput.create(path)
            done = image.open(path, spec) and image.write_image(np.ascontiguousarray(picture))
            if not (image.close() and done):
                raise OSError(_reason(image))
            with open(path, "rb") as file:
                return file.read()
    except OSError as error:
        raise OutputError(f"cannot write a picture among the temporary files: {error}") from None


def _load():
    try:
        import OpenImageIO
    except ImportError as error:
        raise DependencyError(
            f"OpenImageIO is missing ({error}): install it with pip install openimageio"
        ) from None
    return OpenImageIO


def _read_pixels(oiio, path):
    """Read all channels, shape (H, W, channels), and the image's description."""
    wish = oiio.ImageSpec()
    wish.attribute("oiio:UnassociatedAlpha", 1)
    image = oiio.ImageInput.open(path, wish)
    if image is None:
        raise InputError(f"'{path}' cannot be read as an image: {_reason(oiio)}")
    try:
        spec = image.spec()
        if spec.deep or spec.depth > 1:
            raise InputError(f"'{path}' is no flat image but one with depth")
        if spec.width * spec.height > _MOST_PIXELS:
            raise InputError(
                f"'{path}' has {spec.width} × {spec.height} pixels, more than can be worked on"
            )
        pixels = image.read_image(spec.format)
        # What is missing at the end of a TIFF or JPEG comes as an array all the same.
        if pixels is None or image.has_error:
            raise InputError(f"'{path}' is truncated or damaged: {_reason(image)}")
    except MemoryError:
        raise InputError(f"'{path}' is larger than the memory holds; scale it down") from None
    finally:
        image.close()
    return _scaled(_upright(pixels, spec.get_int_attribute("Orientation", 1))), spec


def _reason(teller):
    """What OpenImageIO, or one of its images, says has failed, in one line."""
    return " ".join(teller.geterror().split())


def _scaled(pixels):
    """As float64, integers divided by the greatest of their type."""
    scaled = pixels.astype(np.float64)
    if pixels.dtype.kind in "iu":
        scaled /= np.iinfo(pixels.dtype).max
    return scaled


def _upright(pixels, orientation):
    """Turn an image as its Exif orientation (1 to 8) says, so that its first row is its top."""
    if orientation in (5, 6, 7, 8):
        pixels = pixels.swapaxes(0, 1)
    if orientation in (3, 4, 7, 8):
        pixels = pixels[::-1]
    if orientation in (2, 3, 6, 7):
        pixels = pixels[:, ::-1]
    return pixels

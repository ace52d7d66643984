"""The same void is filled with the same bytes on NumPy 1 and on the newest NumPy 2."""

import json
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
OTHER_PYTHON = ROOT / ".venv-numpy2" / "bin" / "python"

FILL = """
import hashlib, json
import numpy as np
import demsmith

random = np.random.default_rng(7)
rows, columns = np.mgrid[0:200, 0:170]
surface = 900 + 250 * np.sin(rows / 23) * np.cos(columns / 31) + random.normal(0, 4, rows.shape)
void = np.zeros(surface.shape, bool)
for _ in range(12):
    row, column, radius = random.integers(0, 200), random.integers(0, 170), random.integers(1, 20)
    void |= (rows - row) ** 2 + (columns - column) ** 2 < radius**2
hashes = {}
for kind, roughness in (("float32", 0), ("float64", 0), ("int16", 0), ("float32", 0.1)):
    values = np.round(surface).astype(kind)
    values[void] = -32768
    filled = demsmith.fill_voids(values, void, method="mcmd", r_s=roughness, seed=3).values
    assert (filled != -32768).all() and (filled[~void] == values[~void]).all()
    found = hashlib.sha256(np.ascontiguousarray(filled).tobytes()).hexdigest()
    hashes[f"{kind}, r_s {roughness}"] = [str(filled.dtype), found]
assert len({found for _, found in hashes.values()}) == len(hashes)
print(json.dumps({"numpy": np.__version__, "hashes": hashes}))
"""


def fill_with(python, cache):
    """Fill, with a kernel cache of its own: both Pythons would share that beside the source."""
    run = subprocess.run(
        [python, "-c", FILL],
        env=os.environ | {"NUMBA_CACHE_DIR": str(cache)}, capture_output=True, text=True,
    )  # fmt: skip
    assert run.returncode == 0, run.stderr
    return json.loads(run.stdout.splitlines()[-1])


@pytest.mark.skipif(not OTHER_PYTHON.exists(), reason="no .venv-numpy2: run `make env-numpy2`")
def test_filled_bytes_do_not_depend_on_numpy(tmp_path):
    pythons, caches = (sys.executable, OTHER_PYTHON), (tmp_path / "here", tmp_path / "there")
    with ThreadPoolExecutor() as pool:
        here, there = pool.map(fill_with, pythons, caches)
    assert int(there["numpy"].split(".")[0]) >= 2
    assert here["hashes"] == there["hashes"]

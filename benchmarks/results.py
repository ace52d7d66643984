"""How benchmarks say what they measured, and where it is kept: ``benchmarks/RESULTS.md``."""

import datetime
import os
import platform
import re
from importlib.metadata import version
from pathlib import Path

PATH = Path(__file__).resolve().with_name("RESULTS.md")
TITLES = {"gdal": "GDAL", "numba": "Numba", "numpy": "NumPy", "scipy": "SciPy"}


def provenance(*packages):
    """Say when, on what machine and with what packages a benchmark ran."""
    cpu = re.search(r"model name\s*: (.*)", Path("/proc/cpuinfo").read_text())
    versions = [f"Python {platform.python_version()}"]
    versions += [f"{TITLES.get(name, name)} {version(name)}" for name in packages]
    return (
        f"{datetime.date.today()}, {os.cpu_count()} cores of {cpu.group(1) if cpu else '?'}, "
        f"{', '.join(versions)}."
    )


def table(head, rows):
    """Give a Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(map(str, line)) + " |" for line in lines)


def write_section(text):
    """Replace a benchmark's section of RESULTS.md, or add it; its first line is the heading."""
    old = PATH.read_text() if PATH.exists() else "# Results\n"
    title = re.escape(text.splitlines()[0])
    pattern = re.compile(rf"^{title}\n.*?(?=^## |\Z)", re.S | re.M)
    new = pattern.sub(lambda _: text + "\n", old) if pattern.search(old) else f"{old}\n{text}"
    PATH.write_text(new.rstrip() + "\n")

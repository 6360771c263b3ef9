"""Builds the handbook as a site: `make docs`, or `python docs/build.py [--out FOLDER] [--execute]`.

Pages are those of docs/, and those that are made of the declarations: components, papers, the Python interface. A warning
is an error.
"""

import argparse
import gc
import os
import shutil
import sys
import tempfile
from pathlib import Path

DOCS = Path(__file__).resolve().parent
ROOT = DOCS.parent
MARK = ".handbook"  # in the folder of a site, also of one that was not finished
sys.path[:0] = [str(DOCS), str(ROOT)]


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0],
                                      epilog="Example: python docs/build.py --out site")
    options.add_argument("--out", type=Path, default=ROOT / "build/site", help="the site's folder, made anew (build/site)")
    options.add_argument("--execute", action="store_true", help="run the notebooks, so that their pictures are shown")
    options.add_argument("--quiet", action="store_true", help="say what is wrong and no more")
    chosen = options.parse_args()
    os.environ["NUMBA_DISABLE_JIT"] = "1"  # kernels are read here, not compiled
    if chosen.execute:
        os.environ["HANDBOOK_NOTEBOOKS"] = "force"
    try:
        from sphinx.cmd.build import build_main
    except ModuleNotFoundError as error:
        print(f"docs: {error.name} is not installed; `make docs` installs what the site needs", file=sys.stderr)
        return 2
    gc.disable()  # a build lives for seconds, and its trees are full of circles
    from pages.errors import PageError
    from pages.staging import Stage
    from pages.whole import write
    out = chosen.out.absolute()
    if out.exists() and not _is_site(out):
        print(f"docs: {out} is there and is no site; name another folder: --out FOLDER", file=sys.stderr)
        return 2
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    (out / MARK).touch()
    with tempfile.TemporaryDirectory(prefix="handbook-") as work:
        source, files, kept = (Path(work, name) for name in ("docs", "files", "kept"))
        source.mkdir()
        files.mkdir()
        try:
            write(Stage(source, files))
        except PageError as error:
            print(f"docs: {error}", file=sys.stderr)
            return 2
        os.environ["HANDBOOK_FILES"] = str(files)
        del os.environ["NUMBA_DISABLE_JIT"]  # numba has read it; what notebooks start compiles
        arguments = ["-c", str(DOCS), "-d", str(kept), "-W", "--keep-going", "-b", "html"]
        status = build_main([*arguments, *(["-q"] if chosen.quiet else []), str(source), str(out)])
    if status:
        print(f"docs: the site has what stands above; it is not complete ({out})", file=sys.stderr)
        return 1
    print(out / "index.html")
    return 0


def _is_site(folder) -> bool:
    """Whether a build may replace the folder: it is empty, or a build has made it, to its end or not."""
    return folder.is_dir() and (not any(folder.iterdir()) or (folder / MARK).exists())


if __name__ == "__main__":
    sys.exit(main())

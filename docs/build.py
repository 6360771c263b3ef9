"""Builds the handbook as a site: `make docs`, or `python docs/build.py [--out FOLDER] [--execute]`.

Pages are those of docs/, and those that are made of the declarations: components, papers, the Python interface. A warning
is an error.
"""

import argparse
import gc
import os
import shutil
import sys
from pathlib import Path

DOCS = Path(__file__).resolve().parent
ROOT = DOCS.parent
sys.path[:0] = [str(DOCS), str(ROOT)]


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0],
                                      epilog="Example: python docs/build.py --out /tmp/site")
    options.add_argument("--out", type=Path, default=ROOT / "build/site", help="the site's folder, made anew (build/site)")
    options.add_argument("--execute", action="store_true", help="run the notebooks, so that their pictures are shown")
    options.add_argument("--quiet", action="store_true", help="say what is wrong and no more")
    chosen = options.parse_args()
    os.environ["NUMBA_DISABLE_JIT"] = "1"
    if chosen.execute:
        os.environ["HANDBOOK_NOTEBOOKS"] = "force"
    try:
        from sphinx.cmd.build import build_main
    except ModuleNotFoundError as error:
        print(f"docs: {error.name} is not installed; `make docs` installs what the site needs", file=sys.stderr)
        return 2
    gc.disable()  # a build lives for seconds, and its trees are full of circles
    from pages.staging import Stage
    from pages.whole import write
    out = chosen.out.absolute()
    source, files = out.parent / f"{out.name}.source", out.parent / f"{out.name}.files"
    if out.exists() and not _is_site(out):
        print(f"docs: {out} is there and is no site; name another folder: --out FOLDER", file=sys.stderr)
        return 2
    for made in (out, source, files):
        shutil.rmtree(made, ignore_errors=True)
        made.mkdir(parents=True)
    write(Stage(source, files))
    os.environ["HANDBOOK_FILES"] = str(files)
    kept = out / ".kept"
    arguments = ["-c", str(DOCS), "-d", str(kept), "-W", "--keep-going", "-b", "html"]
    status = build_main([*arguments, *(["-q"] if chosen.quiet else []), str(source), str(out)])
    for made in (source, files, kept):
        shutil.rmtree(made, ignore_errors=True)
    if status:
        print(f"docs: the site has what stands above; it is not complete ({out})", file=sys.stderr)
        return 1
    print(out / "index.html")
    return 0


def _is_site(folder) -> bool:
    return not any(folder.iterdir()) or any((folder / name).exists() for name in ("objects.inv", ".kept"))


if __name__ == "__main__":
    sys.exit(main())

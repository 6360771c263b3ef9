"""The order of the site: its sections, and the pages of each.

The pages themselves are plain Markdown and know nothing of it: what Sphinx needs is put at the end of each section's first
page when the site is built.
"""

from pathlib import Path

SECTIONS = {  # the first page of a section -> the patterns of its other pages, in order
    "start": [],
    "tutorials/index": ["tutorials/ros_user", "tutorials/controls_researcher", "tutorials/flight_software_engineer",
                        "tutorials/author_of_a_paper", "notebooks/*"],
    "questions/index": ["questions/*"],
    "components/index": ["components/cubli_ros/*", "components/lander_ros/*", "components/spacerobot_ros/*",
                         "components/sim_nodes/*"],
    "papers/index": ["reproducibility", "gallery", "appc", "papers/appc", "spacerobot", "papers/spacerobot", "lander", "papers/lander",
                     "conventions_lander", "design_rules", "faults_rover", "faults_spacerobot", "faults_lander"],
    "tools": ["extend", "component", "values", "foreign", "bags", "plots", "reports", "seeing", "frames", "campaigns",
              "sampling", "statistics", "lanes", "requirements", "faults", "events", "vehicles", "time",
              "simulation_control", "ros", "flight_computer", "security"],
    "reference_pages": ["reference", "architecture", "portable", "portable_machines"],
    "api/index": ["api/*"],
}


def write(folder: Path) -> None:
    """Put the lists of pages below the site's first page and those of its sections."""
    pages = {path.relative_to(folder).with_suffix("").as_posix() for path in folder.rglob("*")
             if path.suffix in (".md", ".ipynb") and path.relative_to(folder).parts[0] != "files"}
    found = {first: _of(first, patterns, pages) for first, patterns in SECTIONS.items() if first in pages}
    rest = pages - set(found) - {"index"} - {page for pages in found.values() for page in pages}
    if rest:
        found["tools"] += sorted(rest)
    _append(folder / "index.md", list(found))
    for first, others in found.items():
        if others:
            _append(folder / f"{first}.md", others)


def _of(first, patterns, pages):
    out = []
    for pattern in patterns:
        out += [page for page in sorted(pages) if Path(page).match(pattern) and page != first and page not in out]
    return out


def _append(path, pages):
    lines = ["", "```{toctree}", ":hidden:", "", *(f"/{page}" for page in pages), "```", ""]
    with path.open("a", encoding="utf-8") as file:
        file.write("\n".join(lines))

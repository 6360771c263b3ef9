"""The order of the site: its sections, and the pages of each.

The pages themselves are plain Markdown and know nothing of it: what Sphinx needs is put at the end of each section's first
page when the site is built.
"""

from pathlib import Path

SECTIONS = {  # the first page of a section -> its lists: (caption, the patterns of their pages in order)
    "start": [],
    "tutorials/index": [("Tutorials", ["tutorials/ros_user", "tutorials/controls_researcher",
                                       "tutorials/flight_software_engineer", "tutorials/author_of_a_paper"]),
                        ("Notebooks", ["notebooks/index", "notebooks/first_flight", "notebooks/your_own_controller",
                                       "notebooks/*"])],
    "questions/index": [("", ["questions/*"])],
    "components/index": [("Cubli rover", ["components/cubli_ros/*"]), ("Space robot", ["components/spacerobot_ros/*"]),
                         ("Asteroid lander", ["components/lander_ros/*"]), ("Simulated truth", ["components/sim_nodes/*"])],
    "papers/index": [("All three", ["reproducibility", "gallery"]),
                     ("Cubli rover", ["appc", "papers/appc", "faults_rover", "design_rules"]),
                     ("Space robot", ["spacerobot", "papers/spacerobot", "faults_spacerobot"]),
                     ("Asteroid lander", ["lander", "papers/lander", "faults_lander", "conventions_lander"])],
    "tools": [("Write your own", ["extend", "component", "values", "foreign", "vehicles", "events"]),
              ("Look at runs", ["bags", "plots", "reports", "seeing", "frames"]),
              ("Many runs", ["campaigns", "sampling", "statistics", "lanes", "requirements"]),
              ("What breaks", ["faults"]),
              ("Time", ["time", "simulation_control"]),
              ("Beyond", ["ros", "flight_computer", "security"])],
    "reference_pages": [("", ["reference", "architecture", "portable", "portable_machines"])],
    "api/index": [("", ["api/*"])],
}

SHORT = {"questions/index": "Questions", "papers/index": "Papers", "api/index": "Python"}  # as the bar of sections has room


def write(folder: Path) -> None:
    """Put the lists of pages below the site's first page and those of its sections. Pages that no list names go last."""
    pages = {path.relative_to(folder).with_suffix("").as_posix() for path in folder.rglob("*")
             if path.suffix in (".md", ".ipynb")}
    found = {first: [(caption, _of(folder, first, patterns, pages)) for caption, patterns in lists]
             for first, lists in SECTIONS.items() if first in pages}
    named = {page for lists in found.values() for _, names in lists for page in names}
    if rest := sorted(pages - set(found) - named - {"index"}):
        found["tools"].append(("More", rest))
    _append(folder / "index.md", [("", list(found))], folder)
    for first, lists in found.items():
        _append(folder / f"{first}.md", lists, folder)


def _of(folder, first, patterns, pages):
    """The pages of patterns, those of one pattern in the order in which the section's first page links to them."""
    told, out = (folder / f"{first}.md").read_text(encoding="utf-8"), []
    for pattern in patterns:
        named = sorted(page for page in pages if Path(page).match(pattern) and page != first and page not in out)
        places = {page: told.find(f"({page.rpartition('/')[2]}.") for page in named}
        out += sorted(named, key=lambda page: places[page] if places[page] >= 0 else len(told))
    return out


def _append(path, lists, folder):
    for caption, pages in lists:
        if pages:
            lines = ["", "```{toctree}", ":hidden:", *([f":caption: {caption}"] if caption else []), "",
                     *map(_entry, pages), "```", ""]
            with path.open("a", encoding="utf-8") as file:
                file.write("\n".join(lines))


def _entry(page: str) -> str:
    """A component goes by its own name below the caption of its package, a section by a short one."""
    if page in SHORT:
        return f"{SHORT[page]} </{page}>"
    if page.startswith("components/") and page.count("/") == 2:
        return f"{page.rpartition('/')[2]} </{page}>"
    return f"/{page}"

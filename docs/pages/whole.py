"""The whole of the site's sources, in their order."""

from pages import api_pages, component_pages, navigation, paper_pages


def write(stage) -> None:
    """Everything that Sphinx reads, into the stage's folder."""
    stage.copy()
    component_pages.write(stage)
    paper_pages.write(stage)
    api_pages.write(stage)
    stage.write_files()
    navigation.write(stage.folder)

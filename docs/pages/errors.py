"""What is wrong with a page."""


class PageError(Exception):
    """A page that cannot be made; the sentence says what to mend."""

"""Fewer points of lines, with every extreme kept: what is drawn looks as all of it would."""

import numpy as np

MOST = 1000  # points of a line on a page


def chosen(lines: list[np.ndarray], most: int = MOST) -> np.ndarray | None:
    """The indices (m,) to be drawn of lines (n,) on one time axis, m <= about ``most``; None: all of them.

    Of each bucket of neighbours those with the smallest and the largest value of each line, and the two ends.
    """
    count = len(lines[0]) if lines else 0
    if count <= most:
        return None
    size = -(-count // max(1, most // (2 * len(lines))))
    kept = [np.array([0, count - 1])]
    for values in lines:
        whole = count - count % size
        rows = values[:whole].reshape(-1, size)
        first = np.arange(0, whole, size)
        kept += [first + np.where(np.isnan(rows), fill, rows).argmin(axis=1) if sign > 0 else
                 first + np.where(np.isnan(rows), fill, rows).argmax(axis=1) for sign, fill in ((1, np.inf), (-1, -np.inf))]
        if whole < count:
            rest = np.nan_to_num(values[whole:])
            kept.append(np.array([whole + rest.argmin(), whole + rest.argmax()]))
    return np.unique(np.concatenate(kept))

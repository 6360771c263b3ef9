"""What a run makes a person wary of: sentences for its last lines, from the declarations of its metrics.

    number("samples_outside", "1", "samples outside of a funnel", alarm=Alarm(above=0.0, text="a funnel was left"))

A metric that is declared with an alarm says so where its value is beyond the limit. A filter whose record counts what it
``accepted`` and ``rejected`` is asked without a declaration.
"""

import numpy as np

MOST_REJECTED = 0.5  # of the measurements of a filter


def alarms(known, metrics: dict, scenario, signals) -> list[str]:
    """The sentences of a run. known: its glossary; metrics: its numbers by name; signals: topic -> records."""
    found = [entry.alarm.sentence(metrics[name]) for name, entry in known.metrics.items()
             if entry.alarm is not None and name in metrics and entry.alarm.rings(metrics[name])]
    return [*dict.fromkeys(found), *_filters(scenario, signals)]


def _filters(scenario, signals):
    """Filters that refuse most of what they are told."""
    for node, _, signal in scenario.graph.outputs():
        names = signal.dtype.names
        if "accepted" not in names or "rejected" not in names or signal.topic not in signals:
            continue
        last = signals[signal.topic][-1:]
        accepted, rejected = (float(np.sum(last[name])) for name in ("accepted", "rejected"))
        if rejected > MOST_REJECTED * (accepted + rejected):
            yield (f"{node.name} rejected {rejected:g} of {accepted + rejected:g} measurements: what it estimates is "
                   "hardly what they say")

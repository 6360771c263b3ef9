"""Views of fresh records, which kernels take from Python, compiled or plain."""

from flight_math.values import view


def made(kind, period=0.01, **values):
    """A view of a record of a class of Parameters or State, with values of its entries; period [s] of Parameters."""
    record = kind.record(values)
    if "period" in record.dtype.names:
        record["period"] = period
    return view(record[0], kind.kinds)

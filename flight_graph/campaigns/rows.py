"""Rows of a campaign, and the table that they make: one row a run, a function of the campaign and the case number alone.

A column is one of three kinds, which stands in the metadata of its field: ``run`` (case, name of the variant, seed, status,
sentence), ``parameter`` (what was varied) and ``metric``. Columns of two chunks may differ in type (a whole number here, a
real there; one number here, three there): `unified` says what both become.
"""

from dataclasses import dataclass, field

import pyarrow

from flight_graph.errors import FlightError

RUN_COLUMNS = {"case": pyarrow.int64(), "name": pyarrow.string(), "seed": pyarrow.int64(), "status": pyarrow.string(),
               "sentence": pyarrow.string()}
STATUSES = ("ok", "fault", "nonfinite", "refused", "error")


@dataclass
class Row:
    """One run. name: of its variant; status: ok, fault, nonfinite, refused or error; sentence: why it is not ok.

    varied: key -> value, but for the seed; metrics: name -> number, text, truth value or None (not available).
    """

    case: int
    name: str | None
    varied: dict
    seed: int
    status: str = "ok"
    sentence: str = ""
    metrics: dict = field(default_factory=dict)


@dataclass(frozen=True)
class Column:
    """A column of a campaign. kind: run, parameter or metric; type: double, int64, bool, string or null, and of vectors
    double[3]; unit: SI, empty where none is declared.
    """

    name: str
    unit: str
    kind: str
    type: str


def table_of(rows: list[Row], units: dict[str, str] | None = None) -> pyarrow.Table:
    """The table of some rows, in their order. units: of parameters and metrics. Raises FlightError on a metric whose name
    a column has already."""
    columns = {name: pyarrow.array([getattr(row, name) for row in rows], kind) for name, kind in RUN_COLUMNS.items()}
    fields = [_field(name, kind, "run", "") for name, kind in RUN_COLUMNS.items()]
    for part, kind in (("varied", "parameter"), ("metrics", "metric")):
        for key in dict.fromkeys(key for row in rows for key in getattr(row, part)):
            if key in columns:
                raise FlightError(f"the metric '{key}' has the name of another column; name it differently")
            columns[key] = pyarrow.array(_alike([getattr(row, part).get(key) for row in rows]))
            fields.append(_field(key, columns[key].type, kind, (units or {}).get(key, "")))
    return pyarrow.table(list(columns.values()), pyarrow.schema(fields))


def rows_of(table: pyarrow.Table) -> list[Row]:
    """The rows of a table of `table_of`."""
    kinds = {column.name: column.kind for column in columns_of(table.schema)}
    found = []
    for values in table.to_pylist():
        row = Row(values["case"], values["name"], {}, values["seed"], values["status"], values["sentence"])
        for key, kind in kinds.items():
            if kind == "parameter":
                row.varied[key] = values[key]
            elif kind == "metric" and row.status == "ok":
                row.metrics[key] = values[key]
        found.append(row)
    return found


def columns_of(schema: pyarrow.Schema) -> list[Column]:
    """Name, unit, kind and type of the columns of a schema."""
    return [Column(one.name, _said(one, b"unit"), _said(one, b"kind") or "metric", type_text(one.type)) for one in schema]


def type_text(kind: pyarrow.DataType) -> str:
    """A type of a column in a word: double, int64, bool, string, null; of vectors double[3]."""
    return f"{kind.value_type}[{kind.list_size}]" if pyarrow.types.is_fixed_size_list(kind) else str(kind)


def unified(schemas: list[pyarrow.Schema]) -> pyarrow.Schema:
    """The schema that holds the rows of all of them: columns in the order in which they first appear, parameters before
    metrics."""
    found = {}
    for schema in schemas:
        for one in schema:
            known = found.get(one.name)
            found[one.name] = one if known is None else known.with_type(_wider(known.type, one.type))
    order = {"run": 0, "parameter": 1, "metric": 2}
    return pyarrow.schema(sorted(found.values(), key=lambda one: order.get(_said(one, b"kind"), 2)))


def cast(table: pyarrow.Table, schema: pyarrow.Schema) -> pyarrow.Table:
    """A chunk's table with the columns of a unified schema; a column that it has not is null."""
    return pyarrow.table([_cast(table, one) for one in schema], schema)


def _cast(table, wanted):
    if wanted.name not in table.schema.names:
        return pyarrow.nulls(table.num_rows, wanted.type)
    column = table.column(wanted.name)
    if column.type == wanted.type:
        return column
    if pyarrow.types.is_fixed_size_list(wanted.type) and not pyarrow.types.is_nested(column.type):
        size = wanted.type.list_size
        return pyarrow.array([None if value is None else [value] * size for value in column.to_pylist()], wanted.type)
    if pyarrow.types.is_string(wanted.type):
        return pyarrow.array([None if value is None else str(value) for value in column.to_pylist()], wanted.type)
    return column.cast(wanted.type)


def _wider(one: pyarrow.DataType, other: pyarrow.DataType) -> pyarrow.DataType:
    if one == other or pyarrow.types.is_null(other):
        return one
    if pyarrow.types.is_null(one):
        return other
    lists = [kind for kind in (one, other) if pyarrow.types.is_fixed_size_list(kind)]
    inner = [kind.value_type if kind in lists else kind for kind in (one, other)]
    numbers = {"int64", "double"}
    if inner[0] == inner[1]:
        value = inner[0]
    elif {str(kind) for kind in inner} <= numbers:
        value = pyarrow.float64()
    else:
        return pyarrow.string()
    if not lists:
        return value
    sizes = {kind.list_size for kind in lists}
    return pyarrow.list_(value, sizes.pop()) if len(sizes) == 1 else pyarrow.string()


def _alike(values):
    """Values of one column in one type: vectors where another row has a vector, reals, else texts."""
    lengths = {len(value) for value in values if isinstance(value, list)}
    if lengths:
        size = max(lengths)
        rows = [value if value is None or isinstance(value, list) else [value] * size for value in values]
        inner = {type(item) for row in rows if row is not None for item in row}
        if len(lengths) > 1 or not (inner <= {int, float} or len(inner) == 1):
            return [None if row is None else str(row) for row in rows]
        return pyarrow.array(rows, pyarrow.list_(_TYPES[float if inner == {int, float} else inner.pop()], size))
    kinds = {type(value) for value in values if value is not None}
    if kinds == {int, float}:
        return [None if value is None else float(value) for value in values]
    return values if len(kinds) < 2 else [None if value is None else str(value) for value in values]


_TYPES = {int: pyarrow.int64(), float: pyarrow.float64(), bool: pyarrow.bool_(), str: pyarrow.string()}


def _field(name, kind, what, unit):
    return pyarrow.field(name, kind, metadata={"kind": what, "unit": unit})


def _said(one, key) -> str:
    return (one.metadata or {}).get(key, b"").decode("utf-8", "replace")

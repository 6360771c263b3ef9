"""Mistakes outside of kernels: in the file, in the declarations of its classes, in its plain Python."""

from tests.messages.mistakes import Mistake


def declared(name, old, new, *said, line=None, where=""):
    """A mistake in what the file declares; ``where`` follows the line's number."""
    return Mistake(name, old, new, said, line, where)


INPUTS = '    inputs = {"attitude": cubli.ATTITUDE}\n'
OUTPUTS = '    outputs = {"command": cubli.COMMAND}\n'
LAST = "    kernel = law\n"
METHOD = LAST + "\n    @classmethod\n    def {}:\n        {}\n"

FILE = [
    declared("syntax error", "    rates = attitude.angular_velocity\n", "    rates = attitude.angular_velocity +\n",
             "this is no Python (invalid syntax)"),
    declared("unclosed bracket", "GAINS = (1.0, 2.0, 3.0)", "GAINS = (1.0, 2.0, 3.0", "this is no Python", "was never closed"),
    declared("indentation", "    x.integral = x.integral", "      x.integral = x.integral", "this is no Python",
             "unexpected indent", line="x.integral = x.integral"),
    declared("module that is not there", "import numpy as np", "import numpie as np", "there is no module 'numpie'"),
    declared("name that a module has not", "from flight_math import cross, kernel", "from flight_math import cros, kernel",
             "flight_math has no 'cros'", "did you mean 'cross'"),
    declared("name that is not there", "LIST = [1.0, 2.0, 3.0]", "LIST = GAIN", "there is no name 'GAIN' here",
             "did you mean 'GAINS'"),
    declared("kernel that is called", LAST, "    kernel = law()\n", "TypeError"),
    declared("end of the program at the top of the file", "LIST = [1.0, 2.0, 3.0]", "raise SystemExit(0)",
             "it ends the program while it is loaded"),
    declared("exception at the top of the file", "LIST = [1.0, 2.0, 3.0]", "LIST = GAINS[4]", "IndexError"),
    declared("signal that is not there", "cubli.ATTITUDE}", "cubli.ATITUDE}", "msg_schemas.cubli has no 'ATITUDE'", "did you mean 'ATTITUDE'"),
]
RECORDS = [
    declared("reserved name", "    count: int\n", "    size: int\n", "this name is reserved", "take another name",
             where="LawState.size: "),
    declared("reserved entry", "    count: int\n", "    fault: int\n", "this name is reserved", where="LawState.fault: "),
    declared("bad annotation", "    count: int\n", "    count: complex\n", "complex is not allowed", "float, int, bool",
             where="LawState.count: "),
    declared("list as annotation", "    count: int\n", "    count: list\n", "list is not allowed", "Array(...)",
             where="LawState.count: "),
    declared("unknown range", 'field(0.3, unit="1/s", gt=0)', 'field(0.3, unit="1/s", gte=0)', "field has no 'gte'",
             "did you mean 'gt' or 'ge'", where="LawParameters.slope: "),
    declared("unknown keyword of field", 'field(0.3, unit="1/s", gt=0)', 'field(0.3, units="1/s", gt=0)', "field has no 'units'",
             "did you mean 'unit'", where="LawParameters.slope: "),
    declared("used_if of what is no choice", 'field(0.3, unit="1/s", gt=0)', 'field(0.3, used_if={"count": ["a"]})',
             "used_if names 'count', which is no choice of this record", where="LawParameters.slope: "),
    declared("missing annotation", '    note: str = field("")\n', '    note = field("")\n', "it has no annotation",
             where="LawParameters.note: "),
]
DECLARATIONS = [
    declared("text for a signal", INPUTS, '    inputs = {"attitude": "cubli/attitude"}\n',
             "'attitude' is the text 'cubli/attitude'", "msg_schemas.cubli.ATTITUDE", where="Law.inputs: "),
    declared("misspelt text for a signal", INPUTS, '    inputs = {"attitude": "cubli/atitude"}\n',
             "msg_schemas.cubli.ATTITUDE carries 'cubli/attitude'", where="Law.inputs: "),
    declared("set of signals", INPUTS, "    inputs = {cubli.ATTITUDE}\n", "allowed: {'port': SIGNAL", where="Law.inputs: "),
    declared("port called p", INPUTS, '    inputs = {"p": cubli.ATTITUDE}\n', "'p' is no name for a port", where="Law.inputs: "),
    declared("input for inputs", INPUTS, '    input = {"attitude": cubli.ATTITUDE}\n', "no component declares this",
             "did you mean 'inputs'?", where="Law.input: "),
    declared("params for parameters", "parameters, state = LawParameters, LawState", "params, state = LawParameters, LawState",
             "no component declares this", "did you mean 'parameters'?", where="Law.params: "),
    declared("rate for rate_hz", LAST, LAST + "    rate = 50.0\n", "did you mean 'rate_hz'?", where="Law.rate: "),
    declared("fault for faults", LAST, LAST + '    fault = {1: "too steep"}\n', "did you mean 'faults'?", where="Law.fault: "),
    declared("output for outputs", OUTPUTS, '    output = {"command": cubli.COMMAND}\n', "is no function",
             "did you mean 'outputs'?", where="Law.output: "),
    declared("port in both", OUTPUTS, '    outputs = {"attitude": cubli.COMMAND}\n', "inputs and outputs at once",
             where="Law.outputs: "),
    declared("state for parameters", "parameters, state = LawParameters, LawState", "parameters, state = LawState, LawParameters",
             "LawState is a class of State", where="Law.parameters: "),
    declared("number for a state", "parameters, state = LawParameters, LawState", "parameters, state = LawParameters, 3",
             "3 is not allowed", where="Law.state: "),
    declared("no kernel", LAST, "    rate_hz = 50.0\n", "it has no kernel", line="class Law(Component)", where="Law: "),
    declared("kernel and update", LAST, "    kernel, update = law, law\n", "either a kernel, or an output and an update",
             where="Law.kernel: "),
    declared("rate of zero", LAST, LAST + "    rate_hz = 0\n", "0 is not allowed; allowed: a number > 0", where="Law.rate_hz: "),
    declared("slow output that is none", LAST, LAST + '    output_rate_hz = {"comand": 10.0}\n', "there is no output 'comand'",
             "did you mean 'command'", where="Law.output_rate_hz: "),
    declared("optional input as a text", LAST, LAST + '    optional_inputs = "attitude"\n', "write a tuple: ('attitude',)",
             where="Law.optional_inputs: "),
    declared("fault with an unknown name", LAST, LAST + '    faults = {1: "too steep: {slop}"}\n', "names 'slop'",
             "did you mean 'slope'", where="Law.faults: "),
    declared("fault of a form that does not fit", LAST, LAST + '    faults = {1: "too steep: {integral.x:.3f}"}\n',
             "cannot be filled in", "{name[0]}", where="Law.faults: "),
    declared("method without @classmethod", LAST, LAST + "\n    def check(self, values, where):\n        pass\n",
             "write @classmethod above it", line="def check", where="Law.check: "),
]
OWN_PYTHON = [
    declared("default of another length", "weights: Vec3 = field(1.0)", "weights: Vec3 = field((1.0, 2.0))",
             "the default: (1.0, 2.0) is not allowed", "allowed: 3 numbers", where="LawParameters.weights: "),
    declared("default outside of its range", 'field(0.3, unit="1/s", gt=0)', 'field(-0.3, unit="1/s", gt=0)',
             "the default: -0.3 is not allowed", "> 0", where="LawParameters.slope: "),
    declared("exception in resolve", LAST, METHOD.format("resolve(cls, values, where, folder)", "return 1 / 0"),
             "ZeroDivisionError", where="Law.resolve: "),
    declared("unknown parameter in resolve", LAST, METHOD.format(
        "resolve(cls, values, where, folder)", 'return {**values, "slope": values["slop"]}'),
        "there is no parameter 'slop'", "did you mean 'slope'", where="Law.resolve: "),
    declared("resolve returns nothing", LAST, METHOD.format("resolve(cls, values, where, folder)", 'values["slope"] = 1.0'),
             "it returns None", "{**values, ...}", line="def resolve", where="Law.resolve: "),
    declared("resolve returns a parameter that there is not", LAST, METHOD.format(
        "resolve(cls, values, where, folder)", 'return {**values, "slop": 1.0}'), "a parameter 'slop' that there is not",
        line="def resolve", where="Law.resolve: "),
    declared("exception in check", LAST, METHOD.format("check(cls, values, where)", 'values["slope"].real.foo'), "AttributeError",
             where="Law.check: "),
    declared("exception in tables", LAST, METHOD.format("tables(cls, values)", 'return {"integral": open("no_such_file")}'),
             "FileNotFoundError", where="Law.tables: "),
    declared("tables of another shape", LAST, METHOD.format("tables(cls, values)", 'return {"integral": np.zeros(4)}'),
             "integral has the shape (4,)", line="def tables", where="Law.tables: "),
    declared("exception in warnings", LAST, METHOD.format("warnings(cls, values, period_s)", "return [values[0]]"),
             "there is no parameter 0", where="Law.warnings: "),
]
MISTAKES = [*FILE, *RECORDS, *DECLARATIONS]

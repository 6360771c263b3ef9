"""The C header of a component: its records as structs, its parts as functions, its faults as constants."""

import numpy as np

from flight_graph.c_export.machine_code import Part
from flight_graph.components.component import Component
from flight_graph.engines.part_calls import ports
from flight_graph.engines.schedule import stamp_offset

_C = {"f8": "double", "f4": "float", "i8": "int64_t", "i4": "int32_t", "u4": "uint32_t", "u8": "uint64_t", "i2": "int16_t",
      "u2": "uint16_t", "i1": "int8_t", "u1": "uint8_t", "b1": "uint8_t"}
_CONVENTIONS = """\
 * Little-endian processors of {bits} bits. Nothing here allocates, keeps global state or calls the operating
 * system. t_ns counts from the start of the run, in steps of {macro}_PERIOD_NS. Before each call of kernel or output,
 * stamp the outputs ({name}_stamp). Inputs that have not come are blank ({name}_blank_<input>). state.fault != 0: the
 * component has stopped."""


def struct(dtype: np.dtype, name: str) -> str:
    """A packed C struct with the layout of a record; gaps (padding, constant parts of a message) are bytes."""
    return "\n".join([f"struct {name} {{", *_body(dtype, "  "), "} __attribute__((packed, aligned(8)));",
                      f'static_assert(sizeof(struct {name}) == {-(-dtype.itemsize // 8) * 8}, "{name}");', ""])


def _body(dtype, indent):
    lines, end = [], 0
    for field in sorted(dtype.names or (), key=lambda one: dtype.fields[one][1]):
        kind, offset = dtype.fields[field][:2]
        if offset > end:
            lines.append(f"{indent}uint8_t gap_{end}[{offset - end}];")
        end = offset + kind.itemsize
        sizes = "".join(f"[{length}]" for length in kind.shape)
        if kind.base.names:
            lines += [f"{indent}struct {{", *_body(kind.base, indent + "  "),
                      f"{indent}}} __attribute__((packed)) {field}{sizes};"]
        else:
            lines.append(f"{indent}{_C[kind.base.str[1:]]} {field}{sizes};")
    if dtype.itemsize > end:
        lines.append(f"{indent}uint8_t gap_{end}[{dtype.itemsize - end}];")
    return lines


def header(component: type[Component], use: str, name: str, period_ns: int, parts: dict[str, Part], bits: int = 64) -> str:
    """The header of a component, for C11 and C++11. bits: of the processor's addresses."""
    macro, signals = name.upper(), {**component.inputs, **component.outputs}
    lines = [f"/* {use}: {component.summary()}", " *", _CONVENTIONS.format(macro=macro, name=name, bits=bits),
             " * Generated; do not edit. */", f"#ifndef {macro}_H", f"#define {macro}_H", "#include <assert.h>",
             "#include <stdint.h>", "#include <string.h>", "#ifdef __cplusplus", 'extern "C" {', "#endif", "",
             f"#define {macro}_PERIOD_NS INT64_C({period_ns})", ""]
    lines += [struct(component.parameters.dtype, f"{name}_parameters"),
              struct(component.state.dtype, f"{name}_state")]
    for port, signal in signals.items():
        side = "input" if port in component.inputs else "output"
        lines += [f"/* {side} {signal.topic}, {signal.type_name}: the CDR body of the message */",
                  struct(signal.dtype, f"{name}_{port}_message"),
                  f"#define {macro}_{port.upper()}_SIZE {signal.size} /* bytes of the body */",
                  f"#define {macro}_{port.upper()}_STAMP {stamp_offset(signal)} /* where its stamp is */", ""]
    codes = {**component.faults, **{code: text for part in parts.values() for code, text in part.errors.items()}}
    lines += [f"/* state.fault {code}: {text.replace('*/', '* /')} */" for code, text in codes.items()]
    lines += ["", "/* before everything else */",
              f"void {name}_begin(struct {name}_parameters *p, struct {name}_state *x);"]
    lines += [f"void {name}_blank_{port}(struct {name}_{port}_message *record);" for port in signals]
    for part in parts:
        inputs, outputs = ports(component, part)
        lines += [f"/* io: {', '.join(inputs + outputs) or 'not read'} */",
                  f"void {name}_{part}(int64_t t_ns, const struct {name}_parameters *p, struct {name}_state *x,",
                  "    void **io);"]
    lines += ["", f"static inline void {name}_stamp(void *record, unsigned at, int64_t stamp_ns) {{",
              "  int32_t sec = (int32_t)(stamp_ns / 1000000000);",
              "  uint32_t nanosec = (uint32_t)(stamp_ns % 1000000000);",
              "  memcpy((char *)record + at, &sec, 4);", "  memcpy((char *)record + at + 4, &nanosec, 4);", "}",
              "#ifdef __cplusplus", "}", "#endif", "#endif", ""]
    return "\n".join(lines)


def data(component: type[Component], name: str, parameters: np.ndarray, state: np.ndarray) -> str:
    """The C file of the functions that fill records. parameters, state: (1,) records to begin with."""
    lines = [f'#include "{name}.h"', ""]
    signals = {**component.inputs, **component.outputs}
    records = {"begin_parameters": parameters, "begin_state": state} | {
        f"blank_{port}": signal.new()[1] for port, signal in signals.items()}
    for what, record in records.items():
        numbers = ",".join(map(str, record.view("u1").reshape(-1).tolist()))
        lines += [f"static const uint8_t {what}_bytes[] = {{{numbers}}};"]
    lines += ["", f"void {name}_begin(struct {name}_parameters *p, struct {name}_state *x) {{",
              "  memcpy(p, begin_parameters_bytes, sizeof begin_parameters_bytes);",
              "  memcpy(x, begin_state_bytes, sizeof begin_state_bytes);", "}"]
    for port in signals:
        lines += ["", f"void {name}_blank_{port}(struct {name}_{port}_message *record) {{",
                  f"  memcpy(record, blank_{port}_bytes, sizeof blank_{port}_bytes);", "}"]
    return "\n".join([*lines, ""])

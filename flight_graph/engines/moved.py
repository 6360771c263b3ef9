"""A component's machine code in a namespace: the same code, called through a few copies.

The layout of a message holds the name of its frame, so in a namespace the numbers of a record lie elsewhere. The code of a
part is that of the component in no namespace; what is called in its place copies the numbers of the records to where that
code has them, calls it, and copies its outputs back. So every namespace is served by one code, with the same bits.
"""

import hashlib
from functools import cache

from flight_graph.components.component import Component
from flight_graph.engines import machine
from flight_graph.engines.part_calls import parts, ports
from msg_schemas.signal import Signal

MOST = 1 << 16  # [bytes] that are copied a firing; a component with larger records has code of its own in each namespace
_ENTRY = """
declare void @llvm.memcpy.p0.p0.i64(ptr, ptr, i64, i1)
declare void @{inner}(i64, ptr, ptr, ptr)
define void @{symbol}(i64 %t_ns, ptr noalias %p, ptr noalias %x, ptr noalias %io) {{
{text}
  ret void
}}
"""


@cache
def made_of(component: type[Component]) -> type[Component]:
    """The component whose machine code serves this one: the same in no namespace, or itself."""
    plain = component.outside
    if plain is None or any(sum(signal.dtype.itemsize for signal, _ in _pairs(component, part)) > MOST
                            for part in parts(component)):
        return component
    return plain


def called(component: type[Component], part: str, inner: str, address: int) -> int:
    """The address of a part that serves a component, given the symbol and the address of the code of `made_of`."""
    pairs = _pairs(component, part)
    if all(plain.dtype == signal.dtype for plain, signal in pairs):
        return address
    text = _text(inner, pairs, len(ports(component, part)[0]))  # two namespaces may differ in places alone, not in sizes
    symbol = f"{inner}_in_{hashlib.sha256(text.encode()).hexdigest()[:32]}"
    return machine.load_text(symbol, _ENTRY.format(symbol=symbol, inner=inner, text=text), {inner: address})


def _pairs(component, part) -> list[tuple[Signal, Signal]]:
    """The signal of each record, in no namespace and as it is here: inputs, then outputs."""
    plain, (inputs, outputs) = component.outside, ports(component, part)
    return [(plain.inputs[port], component.inputs[port]) for port in inputs] + [
        (plain.outputs[port], component.outputs[port]) for port in outputs]


@cache
def stretches(plain: Signal, moved: Signal) -> list[tuple[int, int, int]]:
    """(place there, place here, length) of all numbers of a record, those together that move together [bytes]."""
    found = []
    for (_, _, there, size), (_, _, here, _) in zip(plain.leaves(), moved.leaves(), strict=True):
        if found:
            first, place, length = found[-1]
            between = there - first - length
            if there - first == here - place and plain.template[4 + there - between:4 + there] == (
                    moved.template[4 + here - between:4 + here]):
                found[-1] = (first, place, there + size - first)
                continue
        found.append((there, here, size))
    return found


def _text(inner, pairs, inputs) -> str:
    """The intermediate code in what is called. inputs: how many of the records are inputs, the first ones."""
    before, after = [], []
    for i, (plain, moved) in enumerate(pairs):
        before += [f"  %io{i} = getelementptr ptr, ptr %io, i64 {i}", f"  %here{i} = load ptr, ptr %io{i}",
                   f"  %slot{i} = getelementptr ptr, ptr %records, i64 {i}"]
        if plain.dtype == moved.dtype:
            before.append(f"  store ptr %here{i}, ptr %slot{i}")
            continue
        before += [f"  %there{i} = alloca [{plain.dtype.itemsize} x i8], align 16", f"  store ptr %there{i}, ptr %slot{i}"]
        for number, (there, here, size) in enumerate(stretches(plain, moved)):
            before += _copy(f"{i}.{number}", there, here, size, i, True)
            after += _copy(f"{i}.{number}.back", there, here, size, i, False) if i >= inputs else []
    call = f"  call void @{inner}(i64 %t_ns, ptr %p, ptr %x, ptr %records)"
    return "\n".join([f"  %records = alloca [{max(len(pairs), 1)} x ptr], align 8", *before, call, *after])


def _copy(name, there, here, size, i, is_in):
    to, source = (f"%to{name}", f"%from{name}") if is_in else (f"%from{name}", f"%to{name}")
    return [f"  %to{name} = getelementptr i8, ptr %there{i}, i64 {there}",
            f"  %from{name} = getelementptr i8, ptr %here{i}, i64 {here}",
            f"  call void @llvm.memcpy.p0.p0.i64(ptr {to}, ptr {source}, i64 {size}, i1 false)"]

"""PTX as C, instruction by instruction: what a graphics processor is told to do, done by this one.

Only the operations that occur in flight code are known; another one is refused by its name. Semantics are those of NVIDIA's
"PTX ISA": operations on float64 round to nearest, shifts are clamped, conversions to whole numbers saturate.
"""

import ctypes
import re
import subprocess
from pathlib import Path

HEAD = r"""
#include <stdint.h>
#include <math.h>
#include <string.h>
typedef uint64_t u64; typedef int64_t s64; typedef uint32_t u32; typedef int32_t s32; typedef uint16_t u16; typedef int16_t s16;
typedef uint8_t u8; typedef int8_t s8; typedef u64 b64; typedef u32 b32; typedef u16 b16; typedef u8 b8; typedef double f64;
typedef float f32;
static f64 D(u64 x) { f64 y; memcpy(&y, &x, 8); return y; }
static u64 B(f64 x) { u64 y; memcpy(&y, &x, 8); return y; }
static f32 S(u32 x) { f32 y; memcpy(&y, &x, 4); return y; }
static u32 C(f32 x) { u32 y; memcpy(&y, &x, 4); return y; }
static s64 whole(f64 x) { return x != x ? INT64_MIN : x >= 0x1p63 ? INT64_MAX : x < -0x1p63 ? INT64_MIN : (s64)x; }
static f64 larger(f64 a, f64 b) { return a != a ? b : b != b ? a : a == b ? (signbit(a) ? b : a) : a > b ? a : b; }
static f64 smaller(f64 a, f64 b) { return a != a ? b : b != b ? a : a == b ? (signbit(a) ? a : b) : a < b ? a : b; }
#define AT(type, place) (*(type *)(place))
u32 block_number, block_size, thread_number;
"""
LAUNCH = """
void launch(u32 blocks, u32 threads, u64 a, u64 b, u64 c, u64 d) {
  block_size = threads;
  for (block_number = 0; block_number < blocks; block_number++)
    for (thread_number = 0; thread_number < threads; thread_number++) flight(a, b, c, d);
}
"""
SPECIAL = {"%ctaid.x": "block_number", "%ntid.x": "block_size", "%tid.x": "thread_number"}
FILES = {"rd": "u64", "r": "u32", "rs": "u16", "p": "u8"}  # of registers -> type
TWO = {"add": "+", "sub": "-", "mul": "*", "and": "&", "or": "|", "xor": "^"}
COMPARED = {"eq": "==", "ne": "!=", "lt": "<", "le": "<=", "gt": ">", "ge": ">=", "lo": "<", "ls": "<=", "hi": ">", "hs": ">="}
ROUNDED = {"rmi": "floor", "rpi": "ceil", "rzi": "trunc"}


def width(kind):
    return int(kind[1:])


def register(text):
    """A register or a name as C."""
    if text in SPECIAL:
        return SPECIAL[text]
    found = re.fullmatch(r"%(rd|rs|r|p)(\d+)", text)
    return f"{found[1]}[{found[2]}]" if found else text.lstrip("%")


def value(text, kind):
    """An operand as a C expression of a type."""
    if text.startswith("0d"):
        bits = f"0x{text[2:]}ULL"
        return f"D({bits})" if kind == "f64" else bits
    if text.startswith("0f"):
        bits = f"0x{text[2:]}U"
        return f"S({bits})" if kind == "f32" else bits
    if re.fullmatch(r"-?\d+", text):
        return f"(({kind})0x{int(text) & (2**64 - 1):x}ULL)"
    name = register(text)
    if kind in ("f64", "f32"):
        return f"{'D' if kind == 'f64' else 'S'}({name})"
    return f"(({kind})(u64)({name}))"


def place(text):
    """[%rd1+8] as an address."""
    base, _, offset = text.strip("[]").partition("+")
    return f"({value(base, 'u64')} + {offset or 0})"


def stored(target, kind, expression):
    """A result in its register, sign or zeros filled up."""
    form = {"f64": "B({})", "f32": "C({})"}.get(kind, f"({kind})({{}})")
    return f"{register(target)} = {form.format(expression)};"


def compared(how, a, b, kind):
    if kind.startswith("f") and how in ("nan", "num"):
        return f"{'' if how == 'nan' else '!'}isunordered({a}, {b})"
    if kind.startswith("f") and how.endswith("u"):
        return f"(isunordered({a}, {b}) || {a} {COMPARED[how[:-1]]} {b})"
    if kind.startswith("f") and how == "ne":
        return f"(!isunordered({a}, {b}) && {a} != {b})"
    return f"({a} {COMPARED[how]} {b})"


def converted(words, target, source):
    to, of = words[-2:]
    given = value(source, of)
    if to.startswith("f") and of.startswith("f"):
        name = next((ROUNDED[word] for word in words[1:-2] if word in ROUNDED), "")
        return stored(target, to, f"{name}(({to}){given})")
    if of.startswith("f"):
        assert "rzi" in words and of == "f64" and to in ("s64", "s32"), words
        return stored(target, to, f"whole({given})")
    return stored(target, to, f"({to}){given}")


def operation(text, targets):
    """One instruction as C."""
    code, _, rest = text.partition(" ")
    words, operands = code.split("."), [part.strip() for part in re.split(r",(?![^\[(]*[\])])", rest)] if rest else []
    name, kind = words[0], words[-1]
    if name == "ret":
        return "goto done;"
    if name == "bra":
        return f"goto {label(operands[0])};"
    if name == "brx":
        cases = " ".join(f"case {i}: goto {label(one)};" for i, one in enumerate(targets[operands[1]]))
        return f"switch ({register(operands[0])}) {{ {cases} }}"
    if name == "call":
        found = re.fullmatch(r"(?:\((\w+)\),\s*)?([\w$]+)(?:,\s*\((.*)\))?", rest)
        return f"{found[1] + ' = ' if found[1] else ''}{found[2]}({found[3] or ''});"
    if name in ("ld", "st") and "param" in words:
        target, source = operands
        return f"{register(target)} = {source.strip('[]')};" if name == "ld" else (
            f"{target.strip('[]')} = {value(source, 'u64')};")
    if name == "ld":
        return f"{register(operands[0])} = AT({kind}, {place(operands[1])});"
    if name == "st":
        return f"AT({kind}, {place(operands[0])}) = {value(operands[1], kind)};"
    if name == "setp":
        assert len(words) == 3, text
        return f"{register(operands[0])} = {compared(words[1], value(operands[1], kind), value(operands[2], kind), kind)};"
    target = operands[0]
    if name == "cvt":
        return converted(words, target, operands[1])
    if name in ("mov", "cvta"):
        return f"{register(target)} = {'1 &' if kind == 'pred' else '(u64)'} {value(operands[1], 'u64')};"
    if kind == "pred":
        a, b = (value(one, "u8") for one in (operands[1:] * 2)[:2])
        return f"{register(target)} = {f'!{a}' if name == 'not' else f'{a} {TWO[name]} {b}'};"
    if name == "selp":
        return f"{register(target)} = {register(operands[3])} ? {value(operands[1], 'u64')} : {value(operands[2], 'u64')};"
    return stored(target, *arithmetic(name, words, kind, operands[1:], text))


def arithmetic(name, words, kind, operands, text):
    """(type, expression) of what is computed."""
    a, b, c = ([value(one, kind) for one in operands] + [None] * 3)[:3]
    if kind.startswith("f"):
        assert name not in ("add", "sub", "mul", "div", "sqrt") or words[1] == "rn", f"{text} rounds as it likes"
        found = {"div": f"{a} / {b}", "sqrt": f"sqrt({a})", "neg": f"-{a}", "abs": f"fabs({a})", "max": f"larger({a}, {b})",
                 "min": f"smaller({a}, {b})", "copysign": f"copysign({b}, {a})"}
        found |= {one: f"{a} {TWO[one]} {b}" for one in ("add", "sub", "mul")}
    else:
        wide, bits = f"u{width(kind)}", width(kind)
        unsigned = ([value(one, wide) for one in operands] * 3)[:max(2, len(operands))]
        if words[1:2] == ["wide"]:
            twice = f"{kind[0]}{2 * bits}"
            return twice, f"({twice}){a} * ({twice}){b}"
        if words[1:2] == ["hi"]:
            return kind, f"(({'__int128' if kind[0] == 's' else 'unsigned __int128'}){a} * {b}) >> {bits}"
        found = {one: f"{unsigned[0]} {TWO[one]} {unsigned[-1]}" for one in TWO}
        if name in ("shl", "shr"):
            by = value(operands[1], "u32")
            past = f"({a} >> {bits - 1})" if name == "shr" and kind[0] == "s" else "0"
            return kind, f"{by} >= {bits} ? {past} : {unsigned[0] if name == 'shl' else a} {'<<' if name == 'shl' else '>>'} {by}"
        found |= {"mad": f"{unsigned[0]} * {unsigned[1]} + {unsigned[-1]}", "neg": f"0 - {unsigned[0]}", "not": f"~{unsigned[0]}",
                  "div": f"{b} ? {a} / {b} : 0", "rem": f"{b} ? {a} % {b} : 0", "max": f"{a} > {b} ? {a} : {b}",
                  "min": f"{a} < {b} ? {a} : {b}", "abs": f"{a} < 0 ? 0 - {a} : {a}"}
    if name not in found:
        raise ValueError(f"an operation of PTX that is not known here: {text}")
    return kind, found[name]


def label(name):
    return name.replace("$", "_")


def body(lines, targets):
    """The statements of a function."""
    for line in lines:
        if found := re.fullmatch(r"([\w$]+):", line):
            yield f"{label(found[1])}:;"
        elif found := re.fullmatch(r"\.reg \.\w+ %(\w+)<(\d+)>;", line):
            yield f"{FILES[found[1]]} {found[1]}[{found[2]}]; (void){found[1]};"
        elif found := re.fullmatch(r"\.reg \.\w+ %(SPL?);", line):
            yield f"u64 {found[1]}; (void){found[1]};"
        elif found := re.fullmatch(r"\.local \.align (\d+) \.b8 ([\w$]+)\[(\d+)\];", line):
            yield f"_Alignas({found[1]}) u8 {found[2]}[{found[3]}];"
        elif found := re.fullmatch(r"\.param \.b(\d+) (\w+);", line):
            yield f"u64 {found[2]};"
        elif line in ("{", "}"):
            yield line
        elif line.startswith(".pragma"):
            continue
        elif found := re.fullmatch(r"(?:@(!?)%(p)(\d+) )?(.*);", line):
            text = operation(found[4], targets)
            yield f"if ({found[1]}p[{found[3]}]) {{ {text} }}" if found[2] else text
        else:
            raise ValueError(f"a line of PTX that is not known here: {line}")


def functions(text):
    """(result, name, names of parameters, lines of the body) of each."""
    form = re.compile(r"^(?:\.visible )?\.(?:func|entry)\s+(?:\(\.param \.\w+ (\w+)\)\s*)?([\w$]+)\((.*?)\)\s*\{\n(.*?)^\}", re.M | re.S)
    for found in form.finditer(text):
        yield found[1], found[2], re.findall(r"\.param .*?([\w$]+)(?:,|\n|$)", found[3]), found[4]


def in_c(ptx: str) -> str:
    """The C program of PTX, with a function ``launch``."""
    text = re.sub(r"//.*", "", ptx)
    made = [HEAD]
    for align, name, size, content in re.findall(
            r"^\.global \.align (\d+) \.b8 ([\w$]+)\[(\d+)\] = \{(.*?)\};", text, re.M):
        made.append(f"static _Alignas({align}) const u8 {name}[{size}] = {{{content}}};")
    found = list(functions(text))
    heads = [f"{'u64' if result else 'void'} {name}({', '.join(f'u64 {one}' for one in parameters)})"
             for result, name, parameters, _ in found]
    made += [f"static {head};" for head in heads]
    for head, (result, _, _, content) in zip(heads, found):
        targets = {name: re.findall(r"[\w$]+", names) for name, names in re.findall(
            r"([\w$]+): \.branchtargets\s+(.*?);", content, re.S)}
        content = re.sub(r"[\w$]+: \.branchtargets\s+.*?;", "", content, flags=re.S)
        lines = [" ".join(line.split()) for line in content.splitlines() if line.strip()]
        made += [f"static {head} {{", f"u64 {result} = 0;" if result else "", *body(lines, targets),
                 "done:;", f"return {result};" if result else "", "}"]
    return "\n".join([*made, LAUNCH])


def compiled(ptx: str, folder: Path):
    """The function launch(blocks, threads, four whole numbers) of PTX."""
    source, library = folder / "ptx.c", folder / "ptx.so"
    source.write_text(in_c(ptx), encoding="utf-8")
    subprocess.run(["cc", "-O0", "-std=gnu11", "-ffp-contract=off", "-fno-strict-aliasing", "-fwrapv", "-w", "-fPIC", "-shared",
                    source, "-o", library, "-lm"], check=True)
    launch = ctypes.CDLL(str(library)).launch
    launch.argtypes, launch.restype = [ctypes.c_uint32] * 2 + [ctypes.c_uint64] * 4, None
    return launch

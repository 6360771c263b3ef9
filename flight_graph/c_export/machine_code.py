"""The machine code of a component's parts for a chosen processor, or LLVM's intermediate code of them.

For this machine it is the code that flies here, under a C name. For another one it is the same code before the last step:
every operation has its place already, and nothing may be contracted, so its results are the same.
"""

import re
from dataclasses import dataclass

import llvmlite.binding as llvm

from flight_graph.c_export import elf
from flight_graph.components import kernel_rules
from flight_graph.components.component import Component
from flight_graph.engines import object_code, part_calls
from flight_graph.engines.compile_errors import translated
from flight_graph.engines.stops import RAISED
from flight_graph.errors import FlightError, unknown


@dataclass(frozen=True)
class Target:
    """A processor. triple, cpu, features, abi: as LLVM names them; address_bits: of its addresses."""

    triple: str
    cpu: str = ""
    features: str = ""
    abi: str = ""
    address_bits: int = 64


HOST, TEXT = "host", "ir"
TARGETS = {HOST: None, "x86_64": Target("x86_64-unknown-linux-gnu", "x86-64"),
           "aarch64": Target("aarch64-unknown-linux-gnu"),
           "riscv64": Target("riscv64-unknown-linux-gnu", "generic-rv64", "+m,+a,+f,+d,+c", "lp64d"),
           # doubles in the VFP, which rounds each operation; no NEON, which would flush small floats to zero
           "armv7": Target("armv7a-unknown-linux-gnueabihf", "generic", "+vfp3d16,-vfp4d16,-neon,-d32", "", 32), TEXT: None}


_GOT = "_GLOBAL_OFFSET_TABLE_"  # of the linker
# In code for 32 bits an address on the stack keeps its place of 64 bits; what counts with its size does not fit.
_ADDRESS_ON_STACK = re.compile(r"(?<= = alloca ).*?(?=, align)")
_SIZE_OF_ADDRESS = re.compile(
    r"^.*(?:(?:global|constant) [^\n]*\bptr\b|getelementptr (?:inbounds |nuw |nusw )*"
    r"(?:ptr|[{\[][^}\]]*\bptr\b[^}\]]*[}\]]),|(?:load|store) [{\[][^}\]]*\bptr\b).*$", re.MULTILINE)


@dataclass(frozen=True)
class Part:
    """A compiled part. code: object code, or intermediate code as text; errors: number in ``fault`` -> sentence."""

    symbol: str
    code: bytes
    errors: dict[int, str]

    @property
    def needs(self) -> list[str]:
        """What it calls outside of itself."""
        if elf.is_elf(self.code):
            return [name for name in elf.undefined(self.code) if name != _GOT]
        return sorted(name for name in object_code.MAY_CALL if b"\0" + name.encode() + b"\0" in self.code)


def address_bits(target: str) -> int:
    """Size of the addresses of a target."""
    return TARGETS[target].address_bits if TARGETS[target] else 64


def parts(component: type[Component], prefix: str, target: str) -> dict[str, Part]:
    """part -> its code under the symbol ``<prefix>_<part>``. Raises FlightError."""
    if target not in TARGETS:
        raise unknown("target", target, TARGETS, "--target")
    kernel_rules.check(component)
    found = {}
    with object_code.installed():
        for part in (part for part in part_calls.parts(component) if part != "place"):  # of a simulation alone
            symbol = f"{prefix}_{part}"
            with translated(component, part):
                code, errors = _part(component, part, symbol, target)
            found[part] = Part(symbol, code, {RAISED + number: text for number, text in errors.items()})
    return found


def _part(component, part, symbol, target):
    kernel, fault = getattr(component, part), component.state.dtype.fields["fault"][1]
    arguments, count = part_calls.compiled_arguments(component, part), len(part_calls.records(component, part)) - 2
    texts = []

    def optimised(module, machine):
        texts.append(str(made := object_code.optimise(module, machine)))
        return made
    code, errors = object_code.part_code(kernel, arguments, count, symbol, fault, optimised, address_bits(target))
    if target == HOST:
        return code, errors
    text = _for_any_processor(texts[0])
    return (text.encode() if target == TEXT else _emit(text, TARGETS[target], component, part)), errors


def _for_any_processor(text: str) -> str:
    """Intermediate code that names no processor."""
    text = re.sub(r'^target (datalayout|triple) = .*\n', "", text, flags=re.MULTILINE)
    return re.sub(r'"target-(cpu|features)"="[^"]*"', "", text)


def _emit(text: str, target: Target, component, part) -> bytes:
    if target.address_bits != 64 and (line := _SIZE_OF_ADDRESS.search(text)):
        raise FlightError(f"{component.__name__}.{part}: it counts with addresses of 64 bits ({line[0].strip()[:80]}), so "
                          f"there is no code of it for {target.triple}")
    if target.address_bits != 64:
        text = _ADDRESS_ON_STACK.sub(lambda found: re.sub(r"\bptr\b", "i64", found[0]), text)
    module, machine = for_target(text, target)
    return machine.emit_object(module)


def for_target(text: str, target: Target):
    """Intermediate code as a module of a target, and LLVM's machine of it."""
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    machine = llvm.Target.from_triple(target.triple).create_target_machine(
        cpu=target.cpu, features=target.features, opt=3, reloc="pic", codemodel="default", abiname=target.abi)
    module = llvm.parse_assembly(text)
    module.triple, module.data_layout = target.triple, str(machine.target_data)
    module.verify()
    return module, machine

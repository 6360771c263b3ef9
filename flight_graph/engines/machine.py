"""The machine that code is made for, and the place where object code becomes callable: llvmlite alone, no numba."""

import threading
from functools import cache

import llvmlite.binding as llvm

_LOCK = threading.RLock()


@cache
def cpu() -> tuple[str, str, str]:
    """(triple, name, features) of this machine's processor."""
    return llvm.get_process_triple(), llvm.get_host_cpu_name(), _features()


def _features():
    try:
        return llvm.get_host_cpu_features().flatten()
    except RuntimeError:  # not known for this processor
        return ""


def target_machine():
    """LLVM's target for position independent code on this machine."""
    _initialise()
    triple, name, features = cpu()
    return llvm.Target.from_triple(triple).create_target_machine(
        cpu=name, features=features, opt=3, reloc="pic", codemodel="default")


@cache
def _initialise():
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()


@cache
def _linker():
    """JITLink puts all of an object into one piece of memory. LLVM's older loader maps code and constants apart, further
    than the 2 GiB that position independent code reaches, in a process whose address space is crowded.
    """
    return llvm.create_lljit_compiler(target_machine(), use_jit_link=True)


_LOADED = {}


def load(symbol: str, code: bytes) -> int:
    """The address of a function of object code; each symbol is loaded once a process."""
    return _load(symbol, lambda library: library.add_object_img(code))


def load_text(symbol: str, text: str, others: dict[str, int]) -> int:
    """The address of a function of intermediate code, as `load`. others: symbol -> address of what it calls."""
    def filled(library):
        for name, address in others.items():
            library.import_symbol(name, address)
        return library.add_ir(text)
    return _load(symbol, filled)


def _load(symbol, filled):
    with _LOCK:
        if symbol not in _LOADED:
            library = filled(llvm.JITLibraryBuilder()).add_current_process().export_symbol(symbol)
            _LOADED[symbol] = library.link(_linker(), symbol)
        return _LOADED[symbol][symbol]

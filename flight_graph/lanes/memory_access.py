"""Loads, stores, addresses and calls of a wide function."""

from flight_graph.lanes import operations
from flight_graph.lanes.divergence import ROOT, Place
from flight_graph.lanes.ir_types import NotWidened, size_of
from flight_graph.lanes.operations import ADDRESSES, LANES, MASK, aligned, wide

_LONGEST = 4096  # [bytes] that are set or copied number by number, for some lanes


class Memory:
    """What a `Widened` function does with memory."""

    def __init__(self, owner, masks):
        self._owner, self._masks, self._sizes = owner, masks, {}

    def _place(self, pointer) -> Place:
        place = self._owner.found.place(pointer)
        if place is None:
            raise NotWidened("a pointer from nowhere")
        return place

    def alloca(self, one):
        """Eight of it, woven like a record."""
        owner = self._owner
        if one.operands:
            kind, count = one.operands[0]
            if owner.differs(count) or kind != "i64":
                raise NotWidened("a work array whose length differs between lanes")
            size = owner.result(f"mul i64 {owner.use(kind, count, False)}, {LANES * size_of(one.detail)}")
            owner.define(one, owner.result(f"alloca i8, i64 {size}, align 64"))
            return
        slot = owner.slot(f"%work{owner.numbers[one.name]}", f"[{LANES * size_of(one.detail)} x i8]", False)
        owner.know_always(one.name, slot)

    def getelementptr(self, one):
        """The address of a part."""
        owner, place = self._owner, self._place(one.operands[0][1])
        woven = place.space in ("lanes", "parameters")
        is_wide = owner.is_wide(one.name)
        step = owner.found.step(one)
        pointer = owner.use("ptr", one.operands[0][1], is_wide)
        if step is not None and not is_wide:
            total = step * (LANES if woven else 1)
        else:
            total = self._offset(one, is_wide, LANES if woven else 1)
        text = f"add {ADDRESSES} {pointer}, {total}" if is_wide else f"getelementptr i8, ptr {pointer}, i64 {total}"
        owner.define(one, owner.result(text))

    def _offset(self, one, is_wide, scale):
        """Bytes of a getelementptr with indices that are no constants."""
        owner, kind, total = self._owner, one.detail, None
        shown = ADDRESSES if is_wide else "i64"
        for number, (index_kind, index) in enumerate(one.operands[1:]):
            if number:
                if not kind.startswith("["):
                    raise NotWidened("a field of a structure by a number")
                kind = kind[1:-1].partition(" x ")[2]
            value = owner.use(index_kind, index, is_wide)
            if index_kind != "i64":
                value = owner.result(f"sext {wide(index_kind) if is_wide else index_kind} {value} to {shown}")
            size = size_of(kind) * scale
            part = owner.result(f"mul {shown} {value}, {f'splat (i64 {size})' if is_wide else size}")
            total = part if total is None else owner.result(f"add {shown} {total}, {part}")
        return total

    def _check(self, place, size):
        """Numbers of a woven record are read and written as they are, never two at once."""
        if size > 8:
            raise NotWidened("a number of more than eight bytes")
        if place.space in ("lanes", "parameters") and place.offset is not None:
            if self._owner.module.widths.get(place.root, {}).get(place.offset, size) != size:
                raise NotWidened("numbers of a record that are read together")
            for offset in range(place.offset, place.offset + size):
                if self._sizes.setdefault((place.root, offset), (place.offset, size)) != (place.offset, size):
                    raise NotWidened("numbers of different widths at one place")

    def _check_all(self, place, kind):
        """The same for each item of an array of numbers: those of the lanes lie together there, too."""
        if not kind.startswith("["):
            self._check(place, size_of(kind))
            return
        count, item = operations.count_of(kind), operations.item_at(kind, [0])
        if size_of(item) != 8:
            raise NotWidened(f"a group of numbers ({kind})")
        for i in range(count):
            self._check(place.moved(8 * i), 8)

    def load(self, one):
        """Read a number."""
        owner, (_, pointer) = self._owner, one.operands[0]
        place, size = self._place(pointer), size_of(one.type)
        if owner.differs(pointer):
            if one.type.startswith(("[", "{")):
                raise NotWidened("a group of numbers at an address that differs between lanes")
            owner.define(one, self._gather(one.type, pointer, place))
            return
        address = owner.use("ptr", pointer, False)
        if owner.found.is_uniform_load(place, size):
            if place.space == "parameters":
                step = LANES * (owner.module.parameters - place.offset) + place.offset
                address = owner.result(f"getelementptr i8, ptr {address}, i64 {step}")
            made = owner.result(f"load {one.type}, ptr {address}, align {min(size, 4)}")
            if owner.is_wide(one.name):
                made = owner.spread(one.type, made)
        else:
            self._check_all(place, one.type)
            made = owner.result(f"load {wide(one.type)}, ptr {address}, align {aligned(size)}")
        owner.define(one, made)

    def store(self, one):
        """Write a number, in the lanes that are to."""
        owner, ((kind, value), (_, pointer)) = self._owner, one.operands
        place, size = self._place(pointer), size_of(kind)
        if place.space != "lanes":
            raise NotWidened("a store into something that all lanes share")
        given = owner.use(kind, value, True)
        if owner.differs(pointer):
            if kind.startswith(("[", "{")):
                raise NotWidened("a group of numbers at an address that differs between lanes")
            self._scatter(kind, given, pointer)
            return
        self._check_all(place, kind)
        address, mask = owner.use("ptr", pointer, False), self._masks.here()
        if mask is not None:
            before = owner.result(f"load {wide(kind)}, ptr {address}, align {aligned(size)}")
            given = owner.pick(MASK, mask, wide(kind), given, before)
        owner.out(f"store {wide(kind)} {given}, ptr {address}, align {aligned(size)}")

    # -- an address for each lane ------------------------------------------------------------------------------------
    def _lane_addresses(self, pointer, place, size, further=0):
        """The address of a number in each lane, so many bytes further; of lanes that are not to work, one that can be read
        and written.
        """
        owner = self._owner
        addresses = owner.use("ptr", pointer, True)
        if place.space in ("lanes", "parameters"):
            steps = ", ".join(f"i64 {lane * size + further}" for lane in range(LANES))
            addresses = owner.result(f"add {ADDRESSES} {addresses}, <{steps}>")
        mask = self._masks.here()
        if mask is not None:
            nowhere = owner.spread("ptr", owner.slot("%nowhere", "[64 x i8]", False))
            addresses = owner.pick(MASK, mask, ADDRESSES, addresses, nowhere)
        for lane in range(LANES):
            number = owner.result(f"extractelement {ADDRESSES} {addresses}, i64 {lane}")
            yield lane, owner.result(f"inttoptr i64 {number} to ptr")

    def _gather(self, kind, pointer, place):
        owner, size, found = self._owner, size_of(kind), "poison"
        kind = "i64" if kind == "ptr" else kind
        for lane, address in self._lane_addresses(pointer, place, size):
            value = owner.result(f"load {kind}, ptr {address}, align {min(size, 4)}")
            found = owner.result(f"insertelement {wide(kind)} {found}, {kind} {value}, i64 {lane}")
        return found

    def _scatter(self, kind, given, pointer, further=0):
        owner, size = self._owner, size_of(kind)
        kind = "i64" if kind == "ptr" else kind
        for lane, address in self._lane_addresses(pointer, self._place(pointer), size, further):
            value = owner.result(f"extractelement {wide(kind)} {given}, i64 {lane}")
            owner.out(f"store {kind} {value}, ptr {address}, align {min(size, 4)}")

    # -- calls -------------------------------------------------------------------------------------------------------
    def call(self, one):
        """A function of LLVM, or a function of the module in its wide form."""
        name = one.detail
        if name.startswith(operations.WITHOUT_EFFECT):
            return
        if name.startswith(("llvm.memset.", "llvm.memcpy.", "llvm.memmove.")):
            self._block(one, name.split(".")[1])
        elif name.startswith("llvm."):
            self._function(one)
        else:
            self._own(one)

    def _block(self, one, what):
        owner = self._owner
        if any(owner.differs(value) for _, value in one.operands):
            self._scattered_block(one, what)
            return
        (_, target), (kind, origin), (_, size) = one.operands[:3]
        spaces = {self._place(target).space} | ({self._place(origin).space} if kind == "ptr" else set())
        if "one" in spaces or "table" in spaces:
            raise NotWidened(f"{what} of what all lanes share")
        if self._masks.here() is not None:
            self._masked_block(one, what, size)
            return
        arguments = [f"ptr {owner.use('ptr', target, False)}", f"{kind} {owner.use(kind, origin, False)}",
                     f"i64 {self._scaled(size)}", "i1 false"]
        name = "llvm.memset.p0.i64" if what == "memset" else f"llvm.{what}.p0.p0.i64"
        owner.module.declare(f"declare void @{name}(ptr, {kind}, i64, i1)")
        owner.out(f"call void @{name}({', '.join(arguments)})")

    def _scaled(self, size):
        """Bytes of eight blocks of this size."""
        if size.isdigit():
            return str(LANES * int(size))
        return self._owner.result(f"mul i64 {self._owner.use('i64', size, False)}, {LANES}")

    def _scattered_block(self, one, what):
        """Zeros at an address of its own in each lane."""
        (_, target), (_, origin), (_, size) = one.operands[:3]
        if what != "memset" or origin != "0" or not size.isdigit() or int(size) % 8 or int(size) > _LONGEST:
            raise NotWidened(f"{what} at an address that differs between lanes")
        for offset in range(0, int(size), 8):
            self._scatter("i64", "zeroinitializer", target, LANES * offset)

    def _masked_block(self, one, what, size):
        """Number by number, as all numbers of eight bytes."""
        owner, mask = self._owner, self._masks.here()
        (_, target), (kind, origin), _ = one.operands[:3]
        place, size = self._place(target), int(size) if size.isdigit() else _LONGEST + 1
        if size % 8 or size > _LONGEST or (kind != "ptr" and origin != "0") or what == "memmove":
            raise NotWidened(f"a large {what} for some lanes")
        number = wide("i64")
        to, values = owner.use("ptr", target, False), []
        for offset in range(0, size, 8):
            self._check(place.moved(offset), 8)
            if kind == "ptr":
                self._check(self._place(origin).moved(offset), 8)
                values.append(self._word(number, owner.use("ptr", origin, False), offset))
            else:
                values.append("zeroinitializer")
        for offset, value in zip(range(0, size, 8), values):
            before, address = self._word(number, to, offset), owner.new()
            value = owner.pick(MASK, mask, number, value, before)
            owner.out(f"{address} = getelementptr i8, ptr {to}, i64 {LANES * offset}")
            owner.out(f"store {number} {value}, ptr {address}, align 32")

    def _word(self, number, pointer, offset):
        owner, address, value = self._owner, self._owner.new(), self._owner.new()
        owner.out(f"{address} = getelementptr i8, ptr {pointer}, i64 {LANES * offset}")
        owner.out(f"{value} = load {number}, ptr {address}, align 32")
        return value

    def _function(self, one):
        owner, found = self._owner, operations.vector_function(one.detail)
        if not owner.is_wide(one.name):
            arguments = ", ".join(f"{kind} {owner.use(kind, value, False)}" for kind, value in one.operands)
            kinds = ", ".join(kind for kind, _ in one.operands)
            owner.module.declare(f"declare {one.type} @{one.detail}({kinds})")
            if one.type == "void":
                owner.out(f"call void @{one.detail}({arguments})")
            else:
                owner.define(one, owner.result(f"call {one.type} @{one.detail}({arguments})"))
            return
        if found is None:
            raise NotWidened(f"a call of {one.detail}")
        name, count = found
        kinds = [wide(kind) if i < count else kind for i, (kind, _) in enumerate(one.operands)]
        values = [owner.use(kind, value, i < count) for i, (kind, value) in enumerate(one.operands)]
        given, result = one.operands[0][0], owner.kind(one)
        kinds_named = [one.type, given] if name in operations.NAMED_BY_BOTH else [given]
        full = ".".join(["llvm", name, *map(operations.suffix, kinds_named)])
        owner.module.declare(f"declare {result} @{full}({', '.join(kinds)})")
        made = owner.result(f"call {result} @{full}({', '.join(map(' '.join, zip(kinds, values)))})")
        owner.define(one, made)

    def _own(self, one):
        owner = self._owner
        kinds, arguments = [], []
        for kind, value in one.operands:
            differs = owner.differs(value)
            if kind == "ptr":
                if differs:
                    raise NotWidened("a function that is given another record in each lane")
                kinds.append(self._passed(value))
                arguments.append(f"ptr {owner.use(kind, value, False)}")
                continue
            kinds.append(differs)
            arguments.append(f"{wide(kind) if differs else kind} {owner.use(kind, value, differs)}")
        mask = self._masks.here()
        masked = owner.masked or owner.found.base[owner.block] != ROOT
        if masked:
            arguments.append(f"{MASK} {mask}")
        is_wide = one.name is not None and owner.is_wide(one.name)
        symbol = owner.module.version(one.detail, tuple(kinds), masked, is_wide)
        if one.name is None or one.type == "void":
            owner.out(f"call void @{symbol}({', '.join(arguments)})")
            return
        made = owner.result(f"call {owner.kind(one)} @{symbol}({', '.join(arguments)})")
        owner.define(one, made)

    def _passed(self, value):
        place = self._place(value)
        return place if place.space in ("parameters", "table") else Place(place.space, "given")

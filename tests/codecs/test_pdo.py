"""Process data is packed as the `canopen` library packs it, the first object lowest."""

import canopen
import pytest
from canopen.objectdictionary import ODVariable, datatypes
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.codecs.pdo import MOST_BITS, Mapped, decode_pdo, encode_pdo, signed
from drivers.codecs.sdo import Entry

CONTROLWORD, TARGET = Entry(0x6040), Entry(0x607A)
TYPES = {8: datatypes.UNSIGNED8, 16: datatypes.UNSIGNED16, 32: datatypes.UNSIGNED32}


@st.composite
def mappings(draw: st.DrawFn) -> list[Mapped]:
    """Up to eight objects that fit into a frame together."""
    widths = draw(st.lists(st.integers(1, 32), min_size=1, max_size=8))
    fitting = [width for i, width in enumerate(widths) if sum(widths[: i + 1]) <= MOST_BITS]
    return [Mapped(Entry(0x2000 + i, i), width) for i, width in enumerate(fitting)]


@pytest.mark.parametrize(
    ("number", "mapped"),
    [  # as the manuals of drives print them
        (0x6040_0010, Mapped(CONTROLWORD, 16)),
        (0x607A_0020, Mapped(TARGET, 32)),
        (0x6099_0220, Mapped(Entry(0x6099, 2), 32)),
    ],
)
def test_a_mapping_is_index_sub_index_and_bits(number: int, mapped: Mapped) -> None:
    assert Mapped.from_number(number) == mapped
    assert mapped.to_number() == number


def test_a_set_point_is_controlword_and_target_little_endian() -> None:
    mapping = [Mapped(CONTROLWORD, 16), Mapped(TARGET, 32)]
    data = encode_pdo(mapping, {CONTROLWORD: 0x003F, TARGET: -2})
    assert data == bytes.fromhex("3F 00 FE FF FF FF")
    assert decode_pdo(mapping, data) == {CONTROLWORD: 0x3F, TARGET: 0xFFFFFFFE}
    assert decode_pdo(mapping, data + b"\x99\x99") == decode_pdo(mapping, data)
    assert decode_pdo(mapping, data[:5]) is None


@pytest.mark.parametrize(
    ("value", "bits", "expected"),
    [(0x7F, 8, 127), (0x80, 8, -128), (0xFFFF, 16, -1), (0xFFFFFFFE, 32, -2), (1, 1, -1)],
)
def test_twos_complement_is_read(value: int, bits: int, expected: int) -> None:
    assert signed(value, bits) == expected


@given(st.data())
@settings(max_examples=200)
def test_the_library_packs_the_same_bytes(data: st.DataObject) -> None:
    dictionary = canopen.ObjectDictionary()  # type: ignore[no-untyped-call]
    widths = data.draw(st.lists(st.sampled_from(list(TYPES)), min_size=1, max_size=4))
    widths = [width for i, width in enumerate(widths) if sum(widths[: i + 1]) <= MOST_BITS]
    mapping = [Mapped(Entry(0x2000 + i), width) for i, width in enumerate(widths)]
    for entry, width in mapping:
        variable = ODVariable(f"object {entry.index}", entry.index)
        variable.data_type = TYPES[width]
        dictionary.add_object(variable)
    maps = canopen.RemoteNode(5, dictionary).tpdo
    theirs = canopen.pdo.PdoMap(maps, None, None)  # type: ignore[no-untyped-call]
    for entry, width in mapping:
        theirs.add_variable(entry.index, 0, width)
    values = {entry: data.draw(st.integers(0, (1 << width) - 1)) for entry, width in mapping}
    for place, value in zip(theirs, values.values(), strict=True):
        place.raw = value
    assert encode_pdo(mapping, values) == bytes(theirs.data)
    assert decode_pdo(mapping, bytes(theirs.data)) == values


@given(st.data())
@settings(max_examples=300)
def test_whatever_fits_survives_whatever_its_width(data: st.DataObject) -> None:
    mapping = data.draw(mappings())
    values = {entry: data.draw(st.integers(0, (1 << bits) - 1)) for entry, bits in mapping}
    assert decode_pdo(mapping, encode_pdo(mapping, values)) == values


@given(mappings(), st.binary(max_size=64))
@settings(max_examples=1_000)
def test_any_frame_is_decoded_or_too_short(mapping: list[Mapped], data: bytes) -> None:
    values = decode_pdo(mapping, data)
    if values is None:
        assert sum(bits for _, bits in mapping) > 8 * len(data)
    else:
        assert data.startswith(encode_pdo(mapping, values)[: sum(b for _, b in mapping) // 8])

import pytest
from flockwire_mocap.natnet.packets import (
    Kind,
    MocapFrame,
    ModelDefinition,
    Other,
    ServerInfo,
    encode,
    encode_command,
    encode_connect,
)
from flockwire_mocap.natnet.parsing import parse
from flockwire_mocap.tracking import ReportedBody
from flockwire_twins.trackers.natnet import (
    Connect,
    RemoteCommand,
    encode_frame,
    encode_model,
    encode_server_info,
    parse_request,
)
from hypothesis import given, settings
from hypothesis import strategies as st

VERSIONS = [(3, 0), (3, 1), (4, 0), (4, 1), (4, 2), (4, 5)]
single = st.floats(width=32, allow_nan=False)
u64 = st.integers(0, 2**64 - 1)
i32 = st.integers(-(2**31), 2**31 - 1)
bodies = st.lists(
    st.builds(ReportedBody, i32, st.none(), st.tuples(*[single] * 3), st.tuples(*[single] * 4), st.booleans()),
    max_size=5,
).map(tuple)
stamps = (st.floats(allow_nan=False), u64, u64)
names = st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"]), max_size=12)


@pytest.mark.parametrize("version", VERSIONS)
@settings(max_examples=30)
@given(frame=st.builds(MocapFrame, i32, bodies, *stamps, st.integers(0, 2**16 - 1)))
def test_frames_survive_the_wire(version, frame):
    assert parse(encode_frame(frame, version), version) == frame


@pytest.mark.parametrize("version", VERSIONS)
@settings(max_examples=30)
@given(model=st.dictionaries(i32, names, max_size=5))
def test_models_survive_the_wire(version, model):
    assert parse(encode_model(model, version), version) == ModelDefinition(model, complete=True)


def test_server_info_survives_the_wire():
    info = ServerInfo("flockwire", (3, 5, 0, 0), (4, 5, 0, 0), 10_000_000, 1511, False, "239.255.42.99")
    assert parse(encode_server_info(info), None) == info


def test_requests_survive_the_wire():
    assert parse_request(encode_connect()) == Connect()
    assert parse_request(encode_command("Bitstream,3.1")) == RemoteCommand("Bitstream,3.1")
    assert parse_request(encode(Kind.KEEP_ALIVE)) == Other(Kind.KEEP_ALIVE)
    assert parse_request(encode(Kind.REQUEST_MODEL) + b"\0") == Other(Kind.REQUEST_MODEL)


def test_a_greeting_is_what_clients_of_the_vendor_send():
    greeting = encode_connect()
    assert greeting[:9] == b"\0\0\x08\x01Ping\0"
    assert greeting[4:] == b"Ping".ljust(256, b"\0") + bytes((0, 0, 0, 0, 4, 5, 0, 0))


@pytest.mark.parametrize("size", [5, 264, 265, 268, 269, 270, 271])
def test_a_greeting_of_any_length_is_one(size):
    assert parse_request(encode(Kind.CONNECT, b"Ping".ljust(size, b"\0"))) == Connect()

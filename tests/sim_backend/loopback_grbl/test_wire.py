from sim_backend.loopback_grbl.wire import Wire


def test_a_byte_takes_ten_bit_times() -> None:
    wire = Wire(115200)
    wire.put(b"a", 1.0)
    assert wire.take(1.0 + 9.9 / 115200) == b""
    assert wire.take(1.0 + 10.1 / 115200) == b"a"


def test_a_real_time_byte_queues_behind_a_line() -> None:
    wire = Wire(115200)
    wire.put(b"x" * 100, 0.0)
    wire.put(b"\x85", 0.0)
    assert b"\x85" not in wire.take(100.5 * 10 / 115200)
    assert wire.take(101.5 * 10 / 115200).endswith(b"\x85")


def test_an_idle_line_starts_at_once() -> None:
    wire = Wire(9600)
    wire.put(b"a", 0.0)
    wire.take(1.0)
    wire.put(b"b", 5.0)
    assert wire.take(5.0 + 10.1 / 9600) == b"b"


def test_clearing_loses_what_is_under_way() -> None:
    wire = Wire(9600)
    wire.put(b"abc", 0.0)
    wire.clear()
    assert len(wire) == 0
    assert wire.take(10.0) == b""

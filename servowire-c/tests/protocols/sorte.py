"""SORTE: rows as commands of tests/c/rows_sorte.c."""

MACHINE = "the master and the device with their start-up are not in the C interface"
NOT_IN_C = {
    "crc8": "checks are made by the parsers",
    "device_state": MACHINE,
    "discovery_chain": MACHINE,
    "drv8711": "the stepper driver is not in the C interface",
    "line_delay": MACHINE,
    "master_startup": MACHINE,
    "negative": "frames of the start-up are not in the C interface",
    "param": "frames of the start-up are not in the C interface",
    "sync0_closed_loop": "the SYNC0 generator is not in the C interface",
    "sync0_figures": "the SYNC0 generator is not in the C interface",
    "sync0_fsm": "the SYNC0 generator is not in the C interface",
    "sync_chain": MACHINE,
    "time_sync": MACHINE,
    "timing_budget": MACHINE,
}

CLASSES = {"BadCrc8": "bad_crc8", "Truncated": "truncated", "WrongSource": "wrong_source", "LengthMismatch": "too_long"}


def ioex_master(row):
    # The preamble and the sums of time stamp and delay are the program's.
    row.ignore("origin", "wire", "devices", "out_offsets", "crc8")
    frame = row["frame"]
    size = len(frame) // 2 - 5
    if (lengths := row.get("out_lengths")) is not None:
        assert sum(lengths) == size
    output = row.get("out_data") or frame[4:-6]
    assert len(output) // 2 == size
    return [(f"sorte_master {size} {frame}", f"ok {row['tx_timestamp']} status {frame[2:4]} ok {frame} {output}")]


def ioex_master_negative(row):
    row.ignore("origin", "base", "byte", "bit")
    frame, expect = row["frame"], row["expect"]
    if expect != "Ok":
        return [(f"sorte_master 16 {frame or '-'}", CLASSES[expect])]
    stamp = int.from_bytes(bytes.fromhex(frame[-4:]), "little")
    # A frame of another status is parsed, and built again as one of the exchange.
    return [(f"sorte_master 16 {frame}", f"ok {stamp} status {frame[2:4]} ok ...")]


def ioex_device(row):
    row.ignore("origin", "last", "error", "wire", "drv_status", "wire_without_crc", "send_time_ns")
    layout, frame = row["layout"], row.get("frame")
    if not layout.endswith("-byte payload"):
        row.ignore("address")
        return []  # Nothing can be checked in the frame of the published image.
    size = int(layout.split("-")[0])
    assert size == 3
    if (expect := row.get("expect")) is not None and expect != "Ok":
        return [(f"sorte_device {size} {frame or '-'}", CLASSES[expect])]
    if expect == "Ok":
        return [(f"sorte_device {size} {frame}", "ok ...")]
    return [(f"sorte_device {size} {frame}", f"ok address {row['address']} status {row['status']} ok {frame} {row['payload']}")]


KINDS = {"NoPulse": "no_pulse", "Pulse": "pulse", "DriverOff": "driver_off", "OutOfRange": "reserved"}


def process_data_slice(row):
    row.ignore("origin")
    raw, kind = row["pto_raw"], row["kind"]
    # A slice is the word and the command, low bytes first.
    assert row["slice"] == (raw.to_bytes(2, "little") + row["command"].to_bytes(2, "little")).hex()
    assert row["driver_enabled"] == (kind != "DriverOff")
    result = "reserved_pto_value" if kind == "OutOfRange" else "ok"
    start = row.get("start_ns", row.get("raw_time", 0)) or 0
    row.ignore("raw_time")
    return [(f"sorte_pto {raw:04x}", f"{result} {KINDS[kind]} start {start} direction {row.get('direction') or 0}")]

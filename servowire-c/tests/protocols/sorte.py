"""SORTE: rows as commands of tests/c/rows_sorte.c."""

MACHINE = "the master and the device with their start-up are not in the C interface"
NOT_IN_C = {
    "device_state": MACHINE,
    "discovery_chain": MACHINE,
    "drv8711": "the stepper driver is not in the C interface",
    "line_delay": MACHINE,
    "master_startup": MACHINE,
    "sync0_closed_loop": "the SYNC0 generator is not in the C interface",
    "sync0_figures": "the SYNC0 generator is not in the C interface",
    "sync0_fsm": "the SYNC0 generator is not in the C interface",
    "sync_chain": MACHINE,
    "time_sync": MACHINE,
    "timing_budget": MACHINE,
}

CLASSES = {"BadCrc8": "bad_crc8", "Truncated": "truncated", "WrongSource": "wrong_source", "LengthMismatch": "too_long"}


def ioex_master(row):
    row.ignore("origin")
    frame, stamp = row["frame"], row["tx_timestamp"]
    # The check byte stands before the time stamp, and the frame is parsed with it.
    assert row.get("crc8", frame[-6:-4]) == frame[-6:-4]
    size = len(frame) // 2 - 5
    if (lengths := row.get("out_lengths")) is not None:
        assert sum(lengths) == size
        assert row["out_offsets"] == [sum(lengths[:at]) for at in range(len(lengths))]
    output = row.get("out_data") or frame[4:-6]
    assert len(output) // 2 == size
    commands = [(f"sorte_master {size} {frame}", f"ok {stamp} status {frame[2:4]} ok {frame} {output}")]
    if (wire := row.get("wire")) is not None:
        assert wire.endswith(frame)
        commands.append((f"sorte_preamble {wire}", f"ok {(len(wire) - len(frame)) // 2}"))
    for at, device in enumerate(row.get("devices") or []):
        # Sums of time stamp and delay are the program's.
        assert device["master_ts_plus_delay"] == stamp + device["line_delay_previous"] and device["address"] == at + 1
        assert output[2 * device["out_offset"]:].startswith(device["slice"])
    return commands


def ioex_master_negative(row):
    row.ignore("origin", "base", "byte", "bit")
    frame, expect = row["frame"], row["expect"]
    if expect != "Ok":
        return [(f"sorte_master 16 {frame or '-'}", CLASSES[expect])]
    stamp = int.from_bytes(bytes.fromhex(frame[-4:]), "little")
    # A frame of another status is parsed, and built again as one of the exchange.
    return [(f"sorte_master 16 {frame}", f"ok {stamp} status {frame[2:4]} ok ...")]


def ioex_device(row):
    row.ignore("origin", "last", "error", "drv_status", "wire_without_crc", "send_time_ns")
    layout, frame = row["layout"], row.get("frame")
    if not layout.endswith("-byte payload"):
        row.ignore("address", "wire")
        return []  # Nothing can be checked in the frame of the published image.
    size = int(layout.split("-")[0])
    assert size == 3
    if (expect := row.get("expect")) is not None and expect != "Ok":
        return [(f"sorte_device {size} {frame or '-'}", CLASSES[expect])]
    if expect == "Ok":
        address, status, payload, wire = int(frame[:2], 16), int(frame[2:4], 16), frame[4:10], None
    else:
        address, status, payload, wire = row["address"], row["status"], row["payload"], row["wire"]
        assert status == row["last"] + 4 * row["error"]
    commands = [(f"sorte_device {size} {frame}", f"ok address {address} status {status} ok {frame} {payload}")]
    if wire is not None:
        assert wire.endswith(frame)
        commands.append((f"sorte_preamble {wire}", f"ok {(len(wire) - len(frame)) // 2}"))
    return commands


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


def crc8(row):
    kind = row["kind"]
    if kind == "lut":
        return [("sorte_lut", row["lut"])]
    if kind == "crc":
        return [(f"sorte_crc8 {row['data'] or '-'}", row["crc8"])]
    if kind == "stream":
        return [(f"sorte_crc8 {row['part1'] or '-'} {row['part2'] or '-'}", f"{row['crc_after_part1']} {row['crc8']}")]
    assert kind == "params" and row["width"] == 8
    row.ignore("refin", "refout")
    check = row["check_123456789"]
    # Of a 1 it is the polynomial; of nothing the start value, of zeros again; behind its own value the residue.
    return [("sorte_crc8 01", row["poly"]), ("sorte_crc8 -", row["init"]), ("sorte_crc8 00000000", row["xorout"]),
            (f"sorte_crc8 313233343536373839 {check}", f"{check} {row['residue']}")]


def param(row):
    # What a device is then is a matter of the machines.
    row.ignore("origin", "state_after")
    fields, frame = row["fields"], row["frame"]
    keys = ("cycle_time_ns", "sync_cycle", "delay_period_ms", "delay_burst", "delay_gap_ms", "delay_fwd_time_ns", "ipg_5ns", "t_in_ns",
            "t_out_ns", "topology", "diagnostics", "alarm", "crc_mode")
    assert set(fields) == set(keys) and row["device_stores_payload"] == frame[8:-8]
    text = " ".join(str(fields[key]) for key in keys)
    return [(f"sorte_param {frame}", f"ok {text} status {row['status']} ok {frame}")]


LONG_CLASSES = {"BadFcs": ("bad_fcs",), "WrongDestination": ("wrong_destination",), "UnknownType": ("unknown_type",),
                "Truncated": ("truncated",), "LengthMismatch": ("too_long", "truncated"), "BadPreamble": ("bad_preamble",)}
LENGTHS = {"DISCOVERY": 1030, "PARAM": 40, "DELAY_REQ": 8, "SYNC": 14}


def negative(row):
    row.ignore("origin", "base")
    kind, expect = row["type"], row["expect"]
    if (wire := row.get("wire")) is not None:
        begin = row["preamble"]
        assert wire.startswith(begin)
        if expect != "Ok":
            return [(f"sorte_preamble {wire}", LONG_CLASSES[expect][0])]
        return [(f"sorte_preamble {wire}", f"ok {len(begin) // 2}"), (f"sorte_startup {kind} {wire[len(begin):]}", "ok same 1")]
    frame = row["frame"]
    if expect == "Ok":
        return [(f"sorte_startup {kind} {frame}", "ok same 1")]
    classes = LONG_CLASSES[expect]
    text = classes[len(classes) > 1 and len(frame) // 2 < LENGTHS[kind]]
    return [(f"sorte_startup {kind} {frame or '-'}", text)]

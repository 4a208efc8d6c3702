"""T-Format: rows as commands of tests/c/rows_tformat.c."""

NOT_IN_C = {"clb_fsm": "a model of a logic block of TI, for simulations"}

IDS = (0, 1, 2, 3, 6, 7, 8, 12, 13)
RESPONSE_FIELDS = {0: 6, 1: 6, 2: 4, 3: 11, 6: 4, 7: 6, 8: 6, 12: 6, 13: 4}
SF = (("EA0", "ea0_counting_error", 0x10), ("EA1", "ea1_other_error", 0x20), ("CA0", "ca0_parity_error", 0x40),
      ("CA1", "ca1_delimiter_error", 0x80))
ALMC = (("OS", "over_speed"), ("FS", "full_absolute_status"), ("CE", "counting_error"), ("OF", "counter_overflow"),
        ("OH", "over_heat"), ("ME", "multi_turn_error"), ("BE", "battery_error"), ("BA", "battery_alarm"))
# What an encoder ID suggests: README of the crate `tformat`.
WIDTHS = {0x0b: (11, 13, 1), 0x11: (17, 16, 1), 0x15: (21, 0, 1), 0x17: (23, 16, 1), 0x14: (20, 16, 0), 0x18: (24, 16, 0)}


def flags(sf, almc):
    """As `say_flags` writes them, from the names of the row."""
    words = ["sf", str(sf["raw"])] + [name for name, key, _ in SF if sf[key]]
    assert sf["info"] == sf["raw"] & 0x0f
    words += ["almc", str(almc["raw"] if almc else 0)] + [name for name, key in ALMC if almc and almc[key]]
    return " ".join(words)


def status(sf):
    return {"raw": sf, "info": sf & 15, **{key: bool(sf & bit) for _, key, bit in SF}}


def content(row, frame):
    """What a decoded frame says, as `say_response` writes it; the bytes built again are those of the frame."""
    cf = row["cf"]
    fields = bytes.fromhex(frame)
    size = RESPONSE_FIELDS[cf >> 3 & 0xf]
    assert cf == fields[0] and row["crc"] == fields[size - 1]
    enid, busy, edf = row.get("enid") or 0, row.get("busy"), row.get("edf")
    if edf is None:
        edf = fields[2] if busy else 0
    text = f"ok id {cf >> 3 & 0xf} abs {row.get('abs') or 0} abm {row.get('abm') or 0} enid {enid}"
    text += f" adf {row.get('adf') or 0} busy {int(bool(busy))} edf {edf} {flags(row.get('sf') or status(0), row.get('almc'))}"
    width = row.get("width")
    if width:
        assert WIDTHS[enid] == (width["abs_bits"], width["abm_bits"], int(width["enid_documented"]))
    if enid in WIDTHS:
        text += " width " + " ".join(map(str, WIDTHS[enid]))
    return text + f" bytes ok {frame[:2 * size]}"


def responses(row):
    row.ignore("origin")
    asked = f"{int(row['request_id'], 16)} {row.get('adf') or 0} {row.get('edf') or 0}"
    expected = content(row, row["bytes"]) if row["expect"] == "ok" else row["error"]
    return [(f"tformat_parse {asked} {row['bytes']}", expected), (f"tformat_line {asked} {row['wire']}", expected)]


def negatives(row):
    """`error` is null where the frame has to be accepted: its fields are then those that stand in it."""
    row.ignore("accept", "flipped_bit", "original")
    kind, frame = row["kind"], row.get("bytes")
    asked = [int(row["request_id"], 16), row.get("adf") or 0, row.get("edf") or 0]
    # Damage that the check field does not see, and bytes behind the frame, leave open what was asked: what fits the answer.
    if kind.startswith("crc_blind") or kind == "trailing_bytes":
        raw = bytes.fromhex(frame)
        if raw[0] & 7 == 2 and bin(raw[0] >> 3).count("1") % 2 == 0 and raw[0] >> 3 & 0xf in IDS:
            asked = [raw[0] >> 3 & 0xf, raw[1] & 0x7f, raw[2]]
    error, asked = row["error"], " ".join(map(str, asked))
    if row["level"] == "wire":
        assert error
        return [(f"tformat_line {asked} {row['wire'] or '-'}", error)]
    row.get("wire")
    expected = error
    if error is None:
        expected = accepted(frame)
        if (consumed := row.get("consumed")) is not None:
            assert consumed == RESPONSE_FIELDS[bytes.fromhex(frame)[0] >> 3 & 0xf]
    if error == "rejected":
        # Rows that are not about the status leave it to the frame.
        expected += " " + flags(row.get("sf") or status(bytes.fromhex(frame)[1]), None)
    commands = [(f"tformat_parse {asked} {frame or '-'}", expected)]
    if (zero := row.get("xor_is_zero")) is not None:
        sum_ = 0
        for byte in bytes.fromhex(frame):
            sum_ ^= byte
        assert zero == (sum_ == 0)
        commands.append((f"tformat_crc {frame}", f"{sum_:02x}"))
    return commands


def accepted(frame):
    """The fields of a frame by TIDM-1011, tables 2-5 and 2-7, for rows that only say that it is accepted."""
    raw = bytes.fromhex(frame)
    id_ = raw[0] >> 3 & 0xf
    row = {"cf": raw[0], "crc": raw[RESPONSE_FIELDS[id_] - 1]}
    three = lambda at: int.from_bytes(raw[at:at + 3], "little")
    if id_ in (6, 13):
        row |= {"adf": raw[1] & 0x7f, "busy": raw[1] > 0x7f, "edf": raw[2]}
    else:
        row["sf"] = status(raw[1])
    if id_ in (0, 7, 8, 12, 3):
        row["abs"] = three(2)
    if id_ == 1:
        row["abm"] = three(2)
    if id_ == 2:
        row["enid"] = raw[2]
    if id_ == 3:
        row |= {"enid": raw[5], "abm": three(6)}
        row["almc"] = {"raw": raw[9], **{key: bool(raw[9] >> bit & 1) for bit, (_, key) in enumerate(ALMC)}}
    return content(row, frame)


def control_field(row):
    if row["kind"] == "classify":
        cf = int(row["cf"], 16)
        text = row["result"]
        code = row.get("data_id")
        if text == "ok":
            text += f" {int(code, 16)}"
        elif code is not None:
            assert int(code, 16) == cf >> 3 & 0xf
        return [(f"tformat_classify {cf}", text)]
    cf = int(row["cf"], 16)
    assert int(row["cf_bit_reversed"], 16) == int(f"{cf:08b}"[::-1], 2) and row["parity"] == cf >> 7
    assert row["wire"] == "0" + f"{cf:08b}"[::-1] + "1"
    text = f"{row['cf']} " + ("ok 1 1" if row["documented"] else "unknown_data_id")
    size, back = row["request_fields"], row["response_fields"]
    if row["documented"]:
        text += f" {size} {back} ok {row['wire']}"
    return [(f"tformat_control_field {int(row['data_id'], 16)}", text)]


def crc(row):
    # The register of a serial implementation is a matter of the model that is not in C.
    row.ignore("lfsr_wire")
    return [(f"tformat_crc {row['bytes'] or '-'}", row["crc"])]


def requests(row):
    asked = f"{int(row['data_id'], 16)} {row.get('adf') or 0} {row.get('edf') or 0}"
    words = " ".join(row["spi10_words"])
    text = f"ok {row['bytes']} ok {row['wire']} ok {row['pru_tx_bytes'][:(row['bits'] + 7) // 8 * 2]}"
    return [(f"tformat_build {asked}", f"{text} {row['ns_2M5']} {row['ns_5M']} {row['response_fields']} ok {words} 1")]


def request_decode(row):
    row.ignore("flipped_bit")
    text = row["error"] if row["expect"] != "ok" else "ok {} {} {} {}".format(
        int(row["data_id"], 16), row.get("adf") or 0, int(row.get("busy_bit") or False), row.get("edf") or 0)
    return [(f"tformat_request {row['bytes'] or '-'}", text)]


def uart_echo(row):
    request, rx, skip = row["request"], row["rx"], row["skip"]
    assert skip == len(request) // 2
    text = row["error"] if row["expect"] != "ok" else content(row, rx[2 * skip:])
    return [(f"tformat_echoed {request} {rx or '-'}", text)]


def position(row):
    text = lambda counts, turns: f"ok ok {counts} {turns} {row['fraction32']} "
    if row["high_bits_nonzero"]:
        expected = "ok ok in doubt " * 2
    else:
        signed, bits = row["turns_signed"], row["abm_bits"]
        expected = text(row["combined_unsigned"], signed % (1 << bits)) + text(row["combined_signed"], signed)
    return [(f"tformat_position {row['abs']} {row['abm']} {row['abs_bits']} {row['abm_bits']}", expected)]


def oversampled(row):
    # How the line was made, and the bits of another rule.
    row.ignore("baud_ppm", "jitter", "gaps", "phase", "spikes", "bits")
    starts = row["start_samples"]
    text = f"ok {row['expect']} {row['spikes_dropped']} {row['expect_bytes']}"
    text += "".join(f" {start}" for start in starts)
    return [(f"tformat_oversampled {row['n']} {row['first']} {' '.join(map(str, row['runs']))}", text)]


EFFECTS = {"all errors": (5, 7, 0), "single turn data (zero position)": (0, 7, 4), "multi turn data and all errors": (5, 0, 0)}
run = None


def procedures(row):
    global run
    if row["kind"] == "reset":
        starts = row["earliest_start_us"]
        assert row["min_gap_us"] == 40 and row["count"] == len(starts)
        id_ = int(row["data_id"], 16)
        assert row["request"] == f"{int(row['request'], 16):02x}"
        # In C the turns are read back after ID C, 18 ms later, as after ID 8: the end of the ten alone does not show.
        wait = row["wait_after_us"]
        if id_ == 12:
            assert wait == 0
            wait = 18000
        text = "ok ok" + "".join(f" {start}" for start in starts) + f" ok sent {row['count']} wait {wait}"
        abs_, abm, almc = EFFECTS[row["effect"]]
        return [(f"tformat_reset {id_} {row['response_delay_us']}", f"{text} abs {abs_} abm {abm} almc {almc}")]
    begin = [("tformat_encoder", "ok")] if row["run"] != run else []
    run = row["run"]
    response, edf = row["response"], row.get("edf")
    if edf is None:
        edf = int(response[4:6], 16)
    text = f"ok {response} {row['adf']} {int(row['busy'])} {edf} {row['page']}"
    return [*begin, (f"tformat_eeprom {row['t_us']} {row['request']}", text)]

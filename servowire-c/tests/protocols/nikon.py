"""A-format: rows as commands of tests/c/rows_aformat.c."""

LAYOUTS = ("ABS40", "ABS24", "ABS24H", "ABS17", "STATUS", "EEPROM", "EEPROM_BANK", "TEMP", "ID", "VELCOEF", "ABS24_ALM",
           "ABS24_TEMP", "ABS24_VEL", "ABS24_VEL_ACC", "ABS40_VEL")
# All encoders answer these (4 to 7 and the other `_MT`), or one whose address is not that of the request (17, 19, and those that set it).
ANY_ADDRESS = {4, 5, 6, 7, 11, 17, 19, 20, 22, 24, 26, 28, 30}

TALKS = "requests as an encoder hears them are not in the C interface"
VALUES = "values as text or in degrees are left to the program"
NOT_IN_C = {
    "alarm": VALUES,
    "anchors": VALUES,
    "crc": "checks are made by the parsers",
    "decode_math": VALUES,
    "eeprom_type_word": VALUES,
    "peer_driver_v9_2": "another driver, compared with the crate",
    "rx_bus": "bits of a line without times",
    "rx_oversampled": "start-stop reception of 16 bits is not in the C interface",
    "rx_unaligned": "bits of a line without times",
    "temperature": VALUES,
    "timing": VALUES,
    "tx_cdf": "frames alone; requests are in tx_transactions",
    "tx_mdf": "frames alone; requests are in tx_transactions",
    "tx_negative": TALKS,
    "tx_ranges": TALKS,
}


def fields(layout, expect):
    """As `say_response` writes them."""
    value = lambda *keys: next((expect[key] for key in keys if expect.get(key) is not None), 0)
    es = value("es") if "es" in expect else 15 * value("es_any")
    return (f"ok layout {LAYOUTS.index(layout)} command {value('cc')} ea {expect['ea']} es {es} abs {value('abs', 'abs_high')} "
            f"velocity {value('velocity')} data {value('data', 'id', 'velocity_coefficient')} alm {value('alm')} "
            f"acceleration {value('acceleration')} temperature {value('temp_raw')} pm_alm {value('pm_alm')} "
            f"address {value('addr')} bank {value('bank')}")


def about(row):
    """Command, layout and address; widths concern positions, which these rows are not about."""
    row.ignore("n", "version", "st_bits", "mt_bits")
    cmd = row["cmd"]
    ea = 255 if cmd in ANY_ADDRESS else row["request_ea"]
    row.ignore("request_ea")
    return f"{cmd} {LAYOUTS.index(row['layout'])} {ea}"


def rx_responses(row):
    asked = about(row)
    # `packed` is `wire` in bytes.
    row.ignore("frames", "bits", "packed")
    expected = fields(row["layout"], row["expect"])
    return [(f"aformat_line {asked} {row['wire']}", expected), (f"aformat_words {asked} {' '.join(row['words'])}", expected)]


def judged(row):
    row.ignore("case")
    options, wire = row.get("options") or {}, row["wire"]
    asked = about(row)
    error = row["expect"].get("error")
    if options.get("check_addr") is False:
        asked = " ".join(asked.split()[:2] + ["255"])
    commands = []
    if echo := options.get("echo"):
        commands += repeated(row, echo, wire, error or "ok")
    elif error:
        commands.append((f"aformat_line {asked} {wire or '-'}", error))
    else:
        commands.append((f"aformat_line {asked} {wire}", "ok ..."))
    return commands


def repeated(row, echo, wire, expected):
    """A row names the argument that has to be repeated; a request in C has all of them, so the others are what was answered."""
    number = lambda at, bits: int(wire[at:at + bits][::-1], 2)
    cmd, bank, address, data = row["cmd"], 0, 0, 0
    version = int(row["version"] == "3.0")
    if row["layout"] in ("EEPROM", "EEPROM_BANK"):
        assert set(echo) == {"addr"}
        bank, address, data = number(37, 8), echo["addr"], number(19, 16)
    else:
        assert set(echo) == {"id"}
        if cmd in (16, 17):
            return []  # A request that reads the code has no code to be repeated.
        data = echo["id"]
    words = [f"{int(wire[k + 1:k + 17], 2):04x}" for k in range(0, len(wire) - 17, 18)]
    request = f"{cmd} {row['request_ea']} {3 if row['layout'] == 'EEPROM_BANK' else 0} {address} {bank} {data}"
    return [(f"aformat_asked {request} {version} {' '.join(words)}", expected)]


def tx_transactions(row):
    row.ignore("n", "gap_between_frames_min_ns", "repeat", "multi_response", "response_bits")
    args, cmd = row["args"], row["cmd"]
    bank = args.get("bank")
    fc = 3 if bank is not None or "coef" in args or (cmd == 16 and row["response_layout"] == "VELCOEF") else 0
    data = next((args[key] for key in ("data", "ident", "coef") if key in args), 0)
    options = {"standard": 1, "factory_option": 7}[row["profile"]]
    frames = row["frames"]
    for frame in frames:
        assert int(frame["wire"][1:17], 2) == int(frame["word16"], 16)
    words = " ".join(frame["word16"] for frame in frames)
    expected = f"ok {words} ok {LAYOUTS.index(row['response_layout'])} {row['response_frames']}"
    return [(f"aformat_build {cmd} {row['ea']} {fc} {args.get('addr', 0)} {bank or 0} {data} {options}", expected)]


rx_bitflips = judged
rx_negative = judged


def turned(words):
    """The first bit of the line in bit 0, where the row has it in bit 15."""
    return ",".join(f"{int(f'{int(word, 16):016b}'[::-1], 2):04x}" for word in words)


def sessions(row):
    row.ignore("n")
    kind = {"eeprom_read": "read", "eeprom_write": "write"}.get(row["procedure"], "reset")
    expect, steps = row["expect"], row["steps"]
    command = f"aformat_procedure {kind} {row['ea']} {row.get('cmd', 0)} {row.get('addr', 0)} {row.get('data', 0)} "
    command += " ".join(turned(step["rx"]) if step["rx"] else "-" for step in steps)
    expected = "ok"
    for at, step in enumerate(steps):
        if at > 0:
            # What C counts from the end of an answer has the line's own gap of 10 us in it; the row's "repeat" does not name its time.
            expected += {"wait_300us_and_repeat": " 310", "wait_30ms": " 30010", "repeat": " 20"}[steps[at - 1]["then"]]
        expected += f" {turned(step['tx'])} {'ok' if step['rx'] else 'no_response'}"
    if expect.get("error"):
        assert expect["error"] == "timeout" and steps[-1]["then"] == "restart_count"
        assert expect["consecutive_done"] == sum(1 for step in steps if step["rx"])
        return [(command, f"{expected} interrupted")]
    assert steps[-1]["then"] == "done"
    assert expect.get("requests_of_this_code", 8) == 8
    return [(command, f"{expected} ok {expect.get('data', expect.get('alm_after', 0))}")]

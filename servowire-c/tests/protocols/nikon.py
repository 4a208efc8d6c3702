"""A-format: rows as commands of tests/c/rows_aformat.c and tests/c/rows_aformat_more.c."""

LAYOUTS = ("ABS40", "ABS24", "ABS24H", "ABS17", "STATUS", "EEPROM", "EEPROM_BANK", "TEMP", "ID", "VELCOEF", "ABS24_ALM",
           "ABS24_TEMP", "ABS24_VEL", "ABS24_VEL_ACC", "ABS40_VEL")
# All encoders answer these (4 to 7 and the other `_MT`), or one whose address is not that of the request (17, 19, and those that set it).
ANY_ADDRESS = {4, 5, 6, 7, 11, 17, 19, 20, 22, 24, 26, 28, 30}

NOT_IN_C = {}


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


def tx_cdf(row):
    row.ignore("n")
    wire, cmd, fc = row["wire"], row["cmd"], row["fc"]
    assert int(row["word16"], 16) == int(wire[1:17], 2)
    packed = row["packed"]
    assert bin(int("1" + packed, 16))[3:] == wire.ljust(4 * len(packed), "1")
    text = f"ok {wire} ok {row['ti_word32']} ok {fc} {row['ea']} {cmd}"
    # Without its arguments a request of version 3.0 is refused by the older encoder alone.
    version = "unsupported_in_version ok" if row["min_version"] == "3.0" else "ok ok"
    return [(f"aformat_frame {fc} 0 {row['ea']} {cmd} 0", text), (f"aformat_in_version {cmd} {fc}", version)]


def tx_mdf(row):
    row.ignore("n")
    wire, fc = row["wire"], row["fc"]
    assert int(row["word16"], 16) == int(wire[1:17], 2)
    # MDF0 to MDF2 have the codes 1 to 3, and MDF3 that of a command.
    assert fc == (int(row["frame"].removeprefix("MDF")) + 1) % 4
    return [(f"aformat_frame {fc} 1 0 0 {row['byte']}", f"ok {wire} ok {row['ti_word32']} ok {fc} {row['byte']}")]


def tx_negative(row):
    row.ignore("n", "case")
    expect = row["expect"]
    text = expect.get("error") or f"ok {expect['fc']} {expect['ea']} {expect['cc']} {expect['byte']}"
    return [(f"aformat_parse_frame {row['wire'] or '-'}", text)]


# What the types of C cannot hold cannot be handed over.
FITS = {"ea": 255, "addr": 255, "bank": 255, "data": 0xffffffff, "ident": 0xffffffff, "coef": 0xffffffff}


def tx_ranges(row):
    row.ignore("n")
    call, error = row["call"], row["expect_error"]
    keys = ("cmd", "ea", "version", "addr", "bank", "data", "ident", "coef")
    value = {key: row[key] for key in keys if row.get(key) is not None}
    if any(value.get(key, 0) > most for key, most in FITS.items()):
        return []
    command = {"cdf": value.get("cmd"), "eeprom_read": 13, "eeprom_write": 14, "id_write": 18, "velocity_coefficient_write": 18}[call]
    fc = 3 if "bank" in value or call == "velocity_coefficient_write" else 0
    version = int(value.get("version", "3.0") == "3.0")
    data = next((value[key] for key in ("data", "ident", "coef") if key in value), 0)
    text = {None: "ok", "unsupported_in_version": "unsupported_in_version"}.get(error, "argument")
    arguments = f"{command} {value.get('ea', 0)} {fc} {value.get('addr', 0)} {value.get('bank', 0)} {data} {version}"
    return [(f"aformat_check {arguments}", text)]


def crc(row):
    row.ignore("n")
    kind, bits, order = row["crc"], row.get("wire_bits"), 0
    base = 2 if kind == "crc3" and bits else 16
    if (text := row.get("input_ascii")) is not None:
        order = int(row["bit_order"] == "msb_first_per_byte")
        packed, count = text.encode().hex(), 8 * len(text)
    else:
        count = len(bits)
        packed = bytes(int(bits[at:at + 8][::-1], 2) for at in range(0, count, 8)).hex()
    return [(f"aformat_crc {kind} {order} {count} {packed}", f"ok {int(row['expect'], base):x}")]


def on_line(row, per_bit, samples, packed):
    row.ignore("n", "frames")
    layout = LAYOUTS.index(row["layout"])
    words = " ".join(row["expect_words"])
    return [(f"aformat_received {layout} {row['cmd']} {per_bit} {samples} {packed}", f"ok ok {words} ok")]


def rx_oversampled(row):
    row.ignore("bit_time_error")
    wire = row["expect_wire"]
    assert row["expect_words"] == [f"{int(wire[at + 1:at + 17], 2):04x}" for at in range(0, len(wire), 18)]
    return on_line(row, row["oversampling"], row["samples"], row["samples_packed_msb_first"])


def rx_unaligned(row):
    row.ignore("leading_idle_bits")
    return on_line(row, 1, row["stream_bits"], row["stream_packed_msb_first"])


def rx_bus(row):
    row.ignore("n", "case", "version")
    text = "ok ok"
    for slot in row["expect"]:
        if error := slot.get("error"):
            text += f" {error}"
            continue
        assert slot["ok"]
        value = lambda *keys: next((slot[key] for key in keys if slot.get(key) is not None), 0)
        es = slot["es"] if "es" in slot else 15 * value("es_any")
        high = slot.get("abs_high")
        text += f" {'duplicate' if slot.get('duplicate') else 'ok'} ea {slot['ea']} es {es} abs {value('abs', 'abs_high')} "
        text += f"alm {value('alm')} temperature {value('temp_raw')} velocity {value('velocity')} acceleration {value('acceleration')}"
    return [(f"aformat_bus {row['cmd']} {LAYOUTS.index(row['layout'])} {row['expected_encoders']} {row['line']}", text)]


def anchors(row):
    row.ignore("n", "source")
    words, want = row["words"], row["expect"]
    known = {"ea", "cc", "es", "es_wire_order", "abs", "crc", "crc_lsb_first_as_printed", "single_turn", "turns", "angle_deg"}
    assert set(want) <= known
    mirror = lambda number, bits: int(f"{number:0{bits}b}"[::-1], 2)
    assert want.get("es_wire_order", mirror(want["es"], 4)) == mirror(want["es"], 4)
    # The CRC-8 is the last byte on the line.
    assert want["crc"] == int(words[-1], 16) & 0xff
    assert want.get("crc_lsb_first_as_printed", mirror(want["crc"], 8)) == mirror(want["crc"], 8)
    # A row does not say the widths: one of those that exist has to fit.
    asked = f"{row['cmd']} {LAYOUTS.index(row['layout'])} {want.get('single_turn', '-')} {want.get('turns', '-')} {' '.join(words)}"
    text = f"ok ea {want['ea']} cc {want['cc']} es {want['es']} fits 1"
    return [(f"aformat_anchor {asked}", text + (f" abs {want['abs']}" if "abs" in want else " ..."))]


def alarm(row):
    row.ignore("n")
    alm = row["alm"]
    assert row["wire_order_bits"] == f"{alm:016b}"[::-1]
    known = sum(1 << ALARMS.index(name) for name in row["set"])
    return [(f"aformat_alarm {alm} {int(row['version'] == '3.0')}", f"{known} {row['summary_es']}")]


ALARMS = ("batt", "mt_err", "ov_flow", "ov_spd", "mem_err", "st_err", "ps_err", "busy", "mem_busy", "ov_temp", "inc_err", "ov_spd_s",
          "st_err_s", "ps_err_s", "busy_s", "inc_err_s")


def temperature(row):
    row.ignore("n")
    plain = row["milli_celsius_unsigned"]
    assert row["whole_celsius_truncated"] == plain // 1000
    return [(f"aformat_temperature {row['temp_raw']}", f"ok {plain} ok {row['milli_celsius_if_twos_complement']}")]


def eeprom_type_word(row):
    row.ignore("n")
    word, none = row["word"], lambda value: 255 if value is None else value
    assert row["multi_turn_code"] == word >> 3 & 3 and row["battery_code"] == word >> 5 & 3
    battery = {None: 255, "none": 0, "separate": 1, "common": 2}[row["battery"]]
    return [(f"aformat_type {word}", f"ok {row['resolution_code']} {none(row['st_bits'])} {none(row['mt_bits'])} {battery}")]


def decode_math(row):
    # Angles as floating-point numbers are the program's.
    row.ignore("n", "angle_deg_f64", "angle_deg_f32_bits")
    whole, low, high, single, turns = row["abs40"], row["abs24_low"], row["abs24_high"], row["single_turn"], row["turns"]
    assert row["abs17"] == whole & 0x1ffff and row["abs40_from_high_and_low"] == whole
    signed = row["turns_signed"]
    assert signed is None or signed % (1 << 16) == turns
    return [(f"aformat_math {row['st_bits']} {row['mt_bits']} {low} {high} {single} {turns}",
             f"ok {whole} ok {whole} ok {row['angle_milli_deg_floor']}")]


def timing(row):
    row.ignore("n", "response_frames", "response_bits")
    rate = {"2.5": 2500000, "4": 4000000, "6.67": 6666667, "8": 8000000, "16": 16000000}[row["mbps"]]
    up = lambda ns: -int(-ns // 1)
    text = f"ok {round(row['bit_ns'] * 1000)} {up(row['response_ns'])} {up(row['one_frame_ns'])} "
    text += f"{up(row['request_plus_response_ns_without_turnaround'])} {row['bus_gap_ns']} {up(row['eight_encoders_ns_without_turnaround'])}"
    return [(f"aformat_times {rate} {LAYOUTS.index(row['layout'])}", text)]


def peer_driver_v9_2(row):
    """What a reply carries, as another driver shows it: ES, identification code and memory mirrored, whole degrees."""
    row.ignore("rx_responses_n", "st_bits", "mt_bits")
    words, driver, cmd = row["words"], row["driver"], row["cmd"]
    layout = PEER[cmd]
    assert driver["crc_received"] == driver["crc_calculated"] == int(words[-1], 16) & 0xff
    alarms = sum(bit << at for at, bit in enumerate(driver["alm_flags"]))
    mirror = lambda number, bits: int(f"{number:0{bits}b}"[::-1], 2)
    es = driver["enc_status_raw"] if layout == "ABS17" else mirror(driver["enc_status_raw"] & 15, 4)
    shown = {"STATUS": f"alm {alarms}", "TEMP": f"whole_degrees {driver['temperature_int']}",
             "ID": f"data {mirror(driver['identification_code_raw'], 24)}"}.get(layout, "")
    return [(f"aformat_peer {cmd} {LAYOUTS.index(layout)} {' '.join(words)}", f"ok ea {driver['enc_addr']} es {es} {shown}".rstrip())]


# With what an encoder of version 2.1 answers.
PEER = {cmd: layout for layout, cmds in {
    "ABS40": (0, 4),
    "ABS24": (1, 5),
    "ABS24H": (2, 6),
    "STATUS": (3, 7, 8, 9, 10, 11, 12),
    "EEPROM": (13, 14),
    "TEMP": (15,),
    "ID": (16, 17, 18, 19, 20),
    "ABS17": (21, 22),
    "ABS24_VEL": (23, 24),
    "ABS24_VEL_ACC": (25, 26),
    "ABS24_ALM": (27, 28),
    "ABS24_TEMP": (29, 30),
}.items() for cmd in cmds}

"""HIPERFACE DSL: rows as commands of tests/c/rows_hdsl.c and tests/c/rows_hdsl_link.c."""

NOT_IN_C = {"sync_startup": "the start-up arithmetic of TI's firmware is in no crate: the conformance runner makes it by itself"}

SICK, TI = 0, 1


def char(pair):
    return pair[0] + ("k" if pair[1] else "")


def byte_encode(row):
    return [(f"hdsl_encode {char((row['byte'], row['k']))} {row['rd_in']}", f"ok {row['code']} {row['rd_out']}")]


def byte_decode(row):
    reduced = row["reduced"]
    said = char((row["byte"], row["k"])) if row["valid"] else "no word"
    if not row["valid"]:
        assert row["byte"] is None and row["k"] is None
    columns = "".join(f" column {rd}" for rd in row["rd_in"])
    flags = f"{int(reduced['byte_error'])} {int(reduced['special'])}"
    text = f"ok ok ok {said}{columns} disparity {row['disparity']} reduced {reduced['byte']} {flags} {reduced['secondary_byte']}"
    return [(f"hdsl_decode {row['code']}", text)]


def byte_stream(row):
    flips = ",".join(map(str, row["flips"])) or "-"
    sent = " ".join(map(char, row["sent"]))
    said = "".join(f" {code} {status} {char(pair) if pair else '-'}"
                   for code, status, pair in zip(row["codes"], row["status"], row["decoded"], strict=True))
    return [(f"hdsl_stream {row['rd_in']} {flips} {sent}", f"{said} {row['rd_out']}")]


def crc16(row):
    if row["kind"] == "frame":
        # What was turned is in the frame.
        row.get("flip")
        return [(f"hdsl_crc16_frame {row['frame']}", str(int(row["ok"])))]
    return [(f"hdsl_crc16 {row['data'] or '-'}", f"ok {row['crc']}")]


def crc5(row):
    word = row["word"]
    if row["kind"] == "word":
        return [(f"hdsl_acceleration {word}", f"ok {row['dd']} ok {word}")]
    row.ignore("flip", "flips")
    return [(f"hdsl_acceleration {word}", "ok ..." if row["ok"] else "acceleration_crc")]


def master_param(row):
    return [(f"hdsl_parameter {row['param']} {row['d_in']}", f"ok {row['code']} {row['d_out']} ok {row['param']}")]


def master_header(row):
    if row["kind"] == "equalisation":
        return [(f"hdsl_equalisation {row['d_in']}", f"ok {row['eq']} {row['d_out']}")]
    if row["kind"] == "free":
        bits = row["bits"]
        text = f"ok {bits} {bits[12:16]} {bits[16:26]} {row['d_out']} ok {row['param']} 0"
        return [(f"hdsl_head {row['param']} 0 {row['d_in']}", text)]
    samples, extra = row["samples"], row["window_bits"]
    assert extra == -(-row["edge_eighths"] // 8)
    # The last bit of the window is a 1 that ends at the edge.
    bits = "".join("0" if samples[at:at + 2] == "00" else "1" for at in range(0, len(samples), 2))
    text = f"ok {bits} {row['eq']} {row['para']} ..."
    return [(f"hdsl_head {row['param']} {row['edge_eighths']} 0", text), (f"hdsl_head_samples {row['param']} {row['edge_eighths']} 0", f"ok ok {row['param']} {extra} ok {samples}")]


def answer(row):
    bits, error = row["bits"], row.get("error")
    if row.get("truncated"):
        row.ignore("fields", "switch_ok", "acc", "dd", "rd_in", "sent", "rd_out", "flip")
        assert error == "truncated"
        return [(f"hdsl_answer {bits or '-'}", "truncated")]
    assert error is None
    said = ""
    for field in row["fields"]:
        strict = char(field["strict"]) if field["strict"] else "-"
        said += f" {strict} {field['byte']} {int(field['byte_error'])} {int(field['special'])}"
    said = f"ok{said} switch {int(row['switch_ok'])} {ACC[row['acc']]} {row.get('dd') or 0}"
    sent, rd_in, rd_out, flip = row.get("sent"), row.get("rd_in"), row.get("rd_out"), row.get("flip")
    command = f"hdsl_answer {bits}"
    if sent and rd_in is not None:
        command += f" {rd_in} {sent['vertical']} {sent['parameter']} {char(sent['pipe'])} "
        command += f"{'-' if sent['acc_k'] else sent['acc']} {char(sent['secondary'])}"
        was = list(bits)
        if flip is not None:
            was[flip] = "10"[int(was[flip])]
        said += f" ok {''.join(was)} {rd_out}"
    return [(command, said)]


ACC = {"ok": "ok", "byte_error": "invalid_word", "encoder_error": "encoder_error", "special_error": "wrong_kind",
       "crc_error": "acceleration_crc"}


def answer_strict(row):
    return [(f"hdsl_answer_strict {row['bits']}", f"ok {ACC[row['acc']]} {row.get('dd') or 0}")]


SAFE = {"ok": "ok", "byte_error": "invalid_word", "crc_error": "crc", "position_invalid": "position_invalid"}


def vframe(row):
    vsync = " ".join("-" if bit is None else str(int(bit)) for bit in row["vsync"])
    return [(f"hdsl_v_frame {' '.join(row['frames'])}",
             f"ok safe1 {SAFE[row['safe1']]} {row['summary']} {row['vpos']} {row['crc1']} safe2 {SAFE[row['safe2']]} "
             f"{row['status2']} {row['vpos2']} {row['crc2']} vsync {vsync}")]


def vframe_strict(row):
    vsync = " ".join("-" if bit is None else str(int(bit)) for bit in row["vsync"])
    # A value with a word in no table is null in the row: the command shows "-" for it.
    said = lambda *keys: " ".join(row[key] or "-" for key in keys)
    return [(f"hdsl_v_frame_strict {' '.join(row['frames'])}",
             f"ok safe1 {SAFE[row['safe1']]} {said('summary', 'vpos', 'crc1')} safe2 {SAFE[row['safe2']]} "
             f"{said('status2', 'vpos2', 'crc2')} vsync {vsync}")]


def learn_by(dialect):
    def of(row):
        row.ignore("kind", "delay_eighths", "jitter", "flip")
        error = row.get("error")
        index, delay = row.get("time_index"), row.get("delay")
        text = f"ok {index} {delay}"
        if error == "pattern_not_found":
            assert delay is None
            text = f"{error} {index} 0"
        elif error:
            assert error == "no_edge" and index is None and delay is None
            text = f"{error} 255 255"
        return [(f"hdsl_learn {dialect} {row['samples'] or '-'}", text)]
    return of


def sampled_answer(row):
    row.ignore("delay_eighths", "jitter", "glitches")
    bits, sent = row["bits"], row["sent"]
    assert row["bit_errors"] == sum(a != b for a, b in zip(bits, sent, strict=True))
    return [(f"hdsl_sampled {row['time_index']} {row['delay']} {row['samples']}", f"ok {bits} {row['rssi']}")]


def rssi(row):
    longest = row["longest"] or 0
    assert row["ti_lut"] == (12 if longest in (1, 2) else row["rssi"])
    return [(f"hdsl_rssi {row['edges']}", f"{longest} {row['rssi']}")]


def edges(row):
    return [(f"hdsl_edges {row['prev_last_sample']} {row['samples']}", f"{row['edges']} {row['rssi']}")]


def sample_edge(row):
    index = row["time_index"]
    assert row["ones"] == bin(int(row["samples"], 16)).count("1") and row["lsb_index"] == 7 - index
    assert row["E"] == (index if row["kind"] == "falling" else 7 - index)
    return [(f"hdsl_sample_edge {row['kind']} {row['samples']}", str(index))]


def tracked(row, dialect):
    command, text = f"hdsl_tracker {dialect} {row['pos_bits']}", "ok"
    for frame in row["frames"]:
        known = {"acc", "byte_error", "usable", "pos", "vel", "vpos", "vpos_valid", "after"}
        assert set(frame) <= known
        command += f" {'-' if frame['byte_error'] else frame['acc']}"
        text += f" {int(frame['usable'])} {frame['pos']} {frame['vel']}"
        valid, after = frame.get("vpos_valid"), frame.get("after")
        if valid is not None:
            command += f",{frame['vpos'] if valid else 'none'}"
        elif after:
            command += ",-"
        assert after or valid is None
        if after:
            text += f" after {after['pos']} {after['vel']} {after['phase']} {int(after['pos_flag'])}"
    return [(command, text)]


def fast_position(row):
    quirk = row["quirk"]
    return tracked(row, TI) + ([] if quirk else tracked(row, SICK))


def fast_position_wrap(row):
    return tracked(row, TI if row["quirk"] else SICK)


EVENTS = ("vsync_ok", "vsync_missing_in_last", "vsync_in_first_seven", "safe1_crc_ok", "safe1_error", "safe2_error",
          "parameter_or_pipe_code", "process_data_code", "unknown_special", "rssi_below_2")


def quality_monitor(row):
    assert row["columns"] == ["event", "qm_ti", "lost_ti", "qm_manual", "lost_manual"]
    command = "hdsl_quality " + " ".join(str(EVENTS.index(step[0])) for step in row["trace"])
    said = "".join(f" {ti} {int(lost)} {sick} {int(gone)}" for _, ti, lost, sick, gone in row["trace"])
    return [(command, f"ok ok {row['start']} {row['start']}{said}")]


def pipe_fifo(row):
    command, text = "hdsl_pipe", "ok"
    for name, first, second in row["ops"]:
        if name == "read":
            # Of a word that is none the row does not say what PIPE_D holds.
            command += " take" if second is not None else " status"
            text += f" {first}" + ("" if second is None else f" {second}")
        else:
            assert name == "word"
            command += f" put,{'-' if first is None else char((first, second))}"
    return [(command, text)]


def flipped(message, flip):
    """A bit turned, counted from the most significant bit of the first byte."""
    data = bytearray.fromhex(message)
    data[flip // 8] ^= 0x80 >> flip % 8
    return data.hex()


def short_message(row):
    reg, answer, kind = row["reg"], row["answer"], row["kind"]
    write = int(kind.startswith("short_write"))
    if kind.endswith("bad_answer"):
        good = flipped(answer, row["flip"])
        return [(f"hdsl_short_answer {reg} {write} {answer}", row["error"]), (f"hdsl_short_answer {reg} {write} {good}", "ok ...")]
    value, request = row["value"], row["request"]
    said = f"{reg} 1 {value}" if write else f"{reg} 0 00"
    got = "00" if write else value
    return [(f"hdsl_short {reg} {write} {value} {answer}", f"ok {request} ok {said} ok {got} ok {answer}")]


LENGTHS = (0, 2, 4, 8)


def long_message(row):
    addr, read, answer = row["addr"], row["read"], row["answer"]
    if row["kind"] == "long_bad_answer":
        # The answer is judged by itself: what was asked is what it says before the flip.
        good = flipped(answer, row["flip"])
        return [(f"hdsl_long_answer {addr} {int(not read)} {good} {answer}", row["error"]),
                (f"hdsl_long_answer {addr} {int(not read)} {good} {good}", "ok")]
    row.ignore("error_code")
    offset = "-" if row["offset"] is None else row["offset"]
    data = row["data"]
    size = LENGTHS[row["llen"]]
    written = "" if read else data
    assert read or len(written) == 2 * size
    result = row["result"]
    delivered = row["pc_buffer"]
    if result == "error":
        assert delivered == row["error_code"]
    else:
        assert delivered == (data if read else "")
    command = f"hdsl_long {addr} {int(not read)} {int(row['indirect'])} {size} {offset} {written or '-'} {answer}"
    return [(command, f"ok {row['request']} ok 1 {'ok' if result == 'ok' else 'resource'} {delivered} ok {answer}")]


def ext_sync_seed(row):
    row.ignore("kind")
    assert row["columns"] == ["extra_size", "time_rest", "num_stuffing", "time_extra_window", "extra_edge"]
    start = row["start"]
    # EXTRA_SIZE is the number of bits less one here, also when TIME_REST is 0.
    edge = start["extra_size"] * 8 + (start["time_rest"] or 8)
    command = f"hdsl_extra {start['time_extra_window']} {edge} {start['num_stuffing']} " + " ".join(map(str, row["adjust"]))
    assert len(row["adjust"]) == len(row["steps"])
    return [(command, f"{start['extra_edge']}" + "".join(" ok " + " ".join(map(str, step)) for step in row["steps"]))]


def fw_sync(row):
    row.ignore("qm")
    assert row["columns"] == ["stuffing_blocks_before", "edge_eighths_after_window_start", "equalisation", "para", "edge_minus_pulse_cycles"]
    assert row["resets"] == 0 and row["startup"]["extra_size"] in range(4, 10)
    nominal, cycles, period, _ = row["startup"]["extra_size"], row["cycles_per_bit"] // 8, row["period_cycles"], row["es"]
    commands, msync = [], []
    for _, edge, equalisation, para, _ in row["frames"]:
        # IDLE with FIRST; the window has as many bits as its edge needs.
        commands.append((f"hdsl_sync_frame {para} {nominal} {edge}", f"ok {PARAMETERS[para]} ok {equalisation} ok {-(-edge // 8)}"))
        msync.append(para)
    runs, last = [], None
    for para in msync:
        if para == last:
            runs[-1] += 1
        else:
            runs.append(1)
        last = para
    assert all(run == 8 for run in runs[1:-1]) and runs[0] <= 8 and runs[-1] <= 8
    for at, (now, after) in enumerate(zip(row["frames"], row["frames"][1:])):
        rest = -(-now[1] // 8) * 8 - now[1]
        want = (rest + 108 * 8 + 48 * after[0] + after[1]) * cycles - period
        # The firmware takes two cycles more for a frame, and one after entries 23 and 31 of every 32.
        assert after[4] - now[4] - want == (1 if at % 32 in (23, 31) else 2)
    return commands


PARAMETERS = {"1001000010": "90", "1001000110": "d0"}

SYMBOLS = {"RESET": 0x1f, "SYNC": 0x19, "START": 0x1a, "LEARN": 0x1b, "CHECK": 0x1c, "IDREQ": 0x1d, "INIT": 0x1e, "IDLE": 0x10}


def fw_startup(row):
    row.ignore("fault", "delay_cycles")
    assert row["columns"] == ["symbol", "param", "master_bits_since_last_answer", "answer", "MASTER_QM", "DELAY", "resets", "ENC_ID2..0",
                              "ONLINE_STATUS_D"]
    frames = row["frames"]
    delay = next((int(frame[5], 16) & 15 for frame in frames if int(frame[5], 16) & 15), 1)
    command, text = f"hdsl_start_up {delay}", ""
    for symbol, param, bits, answer, qm, cable, resets, id_, online in frames:
        silent = all(bit == "1" for bit in answer)
        command += f" {'-' if silent else answer},{qm}"
        if symbol is None:
            text += " gave up"
        else:
            assert SYMBOLS[symbol] == int(param, 16) & 0x1f
            text += f" {param}"
        text += f" {bits or '-'} {qm} {int(cable, 16) & 15} {resets} {id_} {online}"
    shown = int(frames[-1][7], 16)
    id_ = int(row["encoder_id"], 16)
    if shown:
        assert shown == id_ & 0xffff | id_ >> 16 << 20 | id_ >> 16 << 16
    return [(command, text + (f" id {id_:05x}" if shown else " no id"))]


LINK = ["answer", "MASTER_QM", "POS", "VEL", "ONLINE_STATUS_D/1/2", "ACC_ERR_CNT", "align_phase", "VPOS+CRC", "SAFE_SUM",
        "STATUS2+VPOS2+CRC2"]


def linked(row, dialect, noise):
    assert row["columns"] == LINK
    command, text = f"hdsl_link {dialect} {row['pos_bits']} {int(noise)}", ""
    for at, frame in enumerate(row["frames"]):
        if frame[0] == "LINK_LOST":
            assert at == len(row["frames"]) - 1
            if dialect == SICK:
                command += f" L{frame[1]}"
                text += " restarted 6 link 0"
            break
        answer, qm, pos, vel, online, errors, phase, vpos, sum_, safe2 = frame
        command += f" {answer}"
        online = int(online, 16) & (~0x0040_0040_0000 if noise else ~0)
        text += f" {qm} {pos} {vel} {online:012x} {errors} {phase} {vpos} {sum_} {safe2}"
    return [(command, text)]


def fw_link(row):
    return linked(row, TI, row["flip_probability"] > 0)


def link_sick(row):
    row.ignore("kind")
    return linked(row, SICK, False)


used = False


def fw_messages(row):
    """Rows are sessions in order: a short message with nothing in PC_BUFFER after a row with something begins a new one."""
    global used
    request, kind, buffer = bytes.fromhex(row["request"]), row["kind"], row["PC_BUFFER"]
    empty = int(buffer, 16) == 0
    session = "on" if fw_messages.begun else "new"
    if kind != "long" and empty and used:
        session = "new"
        used = False
    fw_messages.begun = True
    used = not empty or used
    writes = []
    if kind == "long":
        read = row["read"]
        row.ignore("addr", "indirect", "llen")
        data = bytes.fromhex(row["data"])
        if not read:
            writes += [(0x20 + at, byte) for at, byte in enumerate(data)]
        if row["offset"] is not None:
            writes += [(0x2a, 0x80 | row["offset"] >> 8), (0x2b, row["offset"] & 0xff)]
        writes += [(0x28, request[0]), (0x29, request[1]), (0x2c, 1)]
    else:
        index = int(row["reg"], 16) & 0x3f
        if kind == "short_read":
            writes = [(0x40, 0x80 | int(row["reg"], 16))]
        else:
            writes = [(0x37, int(row["value"], 16)), (0x40, int(row["reg"], 16))]
        assert index == request[0] & 0x3f
    command = f"hdsl_messages {session} " + " ".join(f"{address:02x}={value:02x}" for address, value in writes)
    command += " | " + " ".join(map(str, row["encoder_symbols"]))
    text = "".join(f" {symbol}" for symbol in row["master_symbols"])
    text += f" | {row['PC_ADD']} {buffer} {row['S_PC_DATA']} {row['EVENT']} {row['EVENT_S']}"
    return [(command, text)]


fw_messages.begun = False


def register_ops(row):
    command, text = "hdsl_operations", "locked 8f"
    for name, *rest in row["ops"]:
        if name == "write":
            command += f" w,{rest[0]},{rest[1]}"
            text += " ok"
        elif name == "read":
            command += f" r,{rest[0]},{rest[1]}"
            text += f" ok {rest[2]}"
        elif name in ("idle", "bad_acc", "encoder_init"):
            command += f" {({'idle': 'idle', 'bad_acc': 'bad', 'encoder_init': 'init'})[name]},{rest[0]}"
        elif name == "vframe":
            command += f" v,{rest[0]},{rest[1]}"
        elif name in ("sent", "sent_init"):
            symbols = [f"0{nibble}" for nibble in rest[0]] if name == "sent" else ["1e"]
            command += f" sent,{''.join(symbols)}"
            text += "".join(f" {symbol}" for symbol in symbols)
        else:
            assert name == "answer"
            command += f" answer,{''.join(rest[0])}"
    return [(command, text)]


learn, learn_leading = learn_by(TI), learn_by(SICK)
globals().update({"8b10b_encode": byte_encode, "8b10b_decode": byte_decode, "8b10b_stream": byte_stream})

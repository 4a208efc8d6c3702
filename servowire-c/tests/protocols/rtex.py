"""RTEX: rows as commands of tests/c/rows_rtex.c and tests/c/rows_rtex_more.c."""

CYCLIC = {"NOP": 0, "PP": 1, "CP": 2, "CV": 3, "CT": 4}
NONCYCLIC = {"normal": 0, "reset": 1, "system_id": 2, "homing": 4, "alarm": 5, "parameter": 6, "profile": 7, "monitor": 10}
CONTROL = ("servo_on", "gain_sw", "tl_sw", "homing_ctrl", "hard_stop", "smooth_stop", "pause", "sl_sw", "ex_out2", "ex_out1")
STATUS = ("servo_active", "servo_ready", "alarm", "warning", "torque_limited", "homing_complete", "in_progress", "in_position", "si_mon5",
          "si_mon4", "si_mon3", "si_mon2", "si_mon1", "home", "pot", "not")

NOT_IN_C = {}


def whole(command, direction, head, flags, names):
    """Rows of whole blocks: `head` are their keys and how the command says them, and `flags` has the bits of bytes 2 and 3."""
    def of(row):
        # Bytes 8 to 15 are handed over as they are: what `data` names in them is the program's.
        row.ignore("data")
        assert (row["mode"], row["dir"]) == (16, direction)
        block, bits = row["hex"], row[flags]
        assert set(bits) == set(names)
        said = [f"{word} {row[key]}" for key, word in head.items()]
        said += [f"cyclic {CYCLIC[row['cyclic']]} noncyclic {NONCYCLIC[row['noncyclic']]} data1 {row[f'{command}_data1']}"]
        said += [f"{name} {bits[name]}" for name in names]
        again = f" ok {block}" if command == "command" else ""
        return [(f"rtex_{command} {block}", f"ok {' '.join(said)} {block[16:]}{again}")]
    return of


commands16 = whole("command", "cmd", {"mac_id": "mac", "update_counter": "counter", "tmg_cnt": "tmg"}, "control", CONTROL)
responses16 = whole("response", "rsp", {"actual_mac_id": "mac", "update_counter_echo": "echo", "cmd_error": "error"}, "status", STATUS)


def axis_traces(row):
    limits, gear = row["limits"], row["gear"]
    keys = ("echo", "command_errors", "wait", "ready", "inactive")
    assert set(limits) == set(keys)
    command = f"rtex_axis {row['mac_id']} {CYCLIC[row['mode']]} {row['update_ns']} {gear[0]} {gear[1]} "
    command += " ".join(str(limits[key]) for key in keys)
    expected = "ok"
    for step in row["steps"]:
        assert set(step) == {"do", "response", "state", "sent"}
        action = step["do"] or "-"
        name, value = next(iter(action.items())) if isinstance(action, dict) else (action, 0)
        command += f" {name},{value},{step['response'] or '-'}"
        expected += f" ok ok {step['state']} {step['sent']}"
    return [(command, expected)]


def main_half(command, direction, head, flags, names):
    """The first 16 bytes of a row of the 32-byte mode, as the other mode reads them."""
    def of(row):
        shape = dict(row)
        short = type(row)({**shape, "mode": 16, "hex": row["hex"][:32]})
        assert row["mode"] == 32 and row["dir"] == direction
        row.unread -= set(head) | {"cyclic", "noncyclic", f"{command}_data1", flags, "data"}
        return whole(command, direction, head, flags, names)(short)
    return of


def commands32(row):
    sub, block = row["sub"], row["hex"]
    code = NONCYCLIC[sub["sub_command"]]
    text = f"ok sub {code} {sub.get('sub_type_code', 0)} {sub.get('sub_index', 0)} "
    text += f"{sub['sub_command_data1']} {sub['sub_command_data2']} {sub['sub_command_data3']} ok {block}"
    head = {"mac_id": "mac", "update_counter": "counter", "tmg_cnt": "tmg"}
    return [(f"rtex_command32 {block}", text)] + main_half("command", "cmd", head, "control", CONTROL)(row)


def responses32(row):
    sub, block = row["sub"], row["hex"]
    index = sub["sub_error_code"] if sub["sub_cmd_err"] else sub["sub_index_echo"]
    text = f"ok sub {NONCYCLIC[sub['sub_command']]} error {sub['sub_cmd_err']} err {sub['sub_err']} wng {sub['sub_wng']} "
    text += f"busy {sub['sub_busy']} {sub.get('sub_type_code_echo', 0)} {index} {sub.get('sub_response_data1', 0)} "
    text += f"{sub['sub_response_data2']} {sub['sub_response_data3']} ok {block}"
    head = {"actual_mac_id": "mac", "update_counter_echo": "echo", "cmd_error": "error"}
    return [(f"rtex_response32 {block}", text)] + main_half("response", "rsp", head, "status", STATUS)(row)


CLASSES = {"wrong_length": ("truncated", "too_long"), "not_a_response": ("direction",), "mac_id_mismatch": ("mac_id",)}


def checked(size, row, block, expected):
    text = CLASSES.get(expected, (expected,))
    if expected == "wrong_length":
        text = ["truncated" if len(block) // 2 < size else "too_long"]
    return f"rtex_check {size} {row['expected_mac_id']} {row['sent_counter']} {row['sent_code']} {block or '-'}", text[0]


def master_check(row):
    row.ignore("case")
    return [checked(row["mode"], row, row["hex"], row["class"])]


def bitflips(row):
    base, bit = bytearray.fromhex(row["base"]), row["bit"]
    size = len(base)
    commands = [checked(size, row, base.hex(), "ok")]
    base[bit // 8] ^= 1 << bit % 8
    assert base.hex() == row["hex"]
    return commands + [checked(size, row, row["hex"], row["class"])]


FAULTS = {"c_r_set": "direction", "undefined_cyclic": "cyclic_code", "undefined_noncyclic": "non_cyclic_code"}
SUB_FAULTS = {"sub_chk_clear": "sub_chk", "undefined_sub_command": "sub_command_code"}


def drive_check(row):
    mode, block, fault, alarm = row["mode"], row["hex"], row["fault"], row["alarm"]
    number = alarm.removeprefix("Err") if alarm else "0.0"
    main = FAULTS.get(fault, "ok")
    both = "-" if mode == 16 else main if main != "ok" else SUB_FAULTS.get(fault, "ok")
    reserved = "1" if fault == "reserved_control_bit_set" else "0" if fault == "none" else "..."
    assert (int(block[:2], 16) & 0x1f != row["drive_mac_id"]) == (fault == "mac_id_mismatch")
    text = f"ok {row['error_code'] or '0000'} {row['sub_error_code'] or '0000'} {number} {main} {both} reserved {reserved}"
    return [(f"rtex_drive {mode} {row['drive_mac_id']} {block}", text)]


def header_byte0(row):
    return [(f"rtex_byte0 {row['byte0']}", f"{row['c_r']} {row['update_counter']} {row['mac_id']} {row['byte0']}")]


def header_byte1(row):
    byte, cyclic, noncyclic = row["byte1"], row["cyclic_code"], row["noncyclic_code"]
    assert row["cyclic"] == {code: name for name, code in CYCLIC.items()}.get(cyclic)
    assert row["noncyclic"] == {code: name for name, code in NONCYCLIC.items()}.get(noncyclic)
    sent = "cyclic_code" if row["cyclic"] is None else "non_cyclic_code" if row["noncyclic"] is None else f"ok {row['bit7']} {byte}"
    return [(f"rtex_byte1 {byte}", f"{row['bit7']} {cyclic} {noncyclic} {byte} {row['error_code'] or '0000'} {sent}")]


def packing(row):
    assert row["mode"] == len(row["hex"]) // 2
    return [(f"rtex_words {row['hex']}", f"ok {' '.join(row['words32'])} ok 1 ok {' '.join(row['words16'])} ok 1 argument")]


def control_bits(row):
    bits, sent, reserved = row["bits"], row["bytes2_3"], row.get("reserved_set") or 0
    block = f"0020{sent}" + 24 * "0"
    shown = "".join(f" {name} {int(name in bits)}" for name in CONTROL)
    known = "..." if reserved else f"{sent} ok ok"
    # Reserved bits are sent as 0, so only a block without them is built again as it was.
    again = " ok ..." if reserved else f" ok {block}"
    head = f"ok mac 0 counter 0 tmg 0 cyclic 2 noncyclic 0 data1 0{shown} {block[16:]}{again}"
    return [(f"rtex_control {sent}", f"{sent} ok ok" if not reserved else "0000 ok reserved" if not bits else known),
            (f"rtex_command {block}", head)]


def status_flags(row):
    bits, sent = row["bits"], row["bytes2_3"]
    block = f"8020{sent}" + 24 * "0"
    shown = "".join(f" {name} {int(name in bits)}" for name in STATUS)
    return [(f"rtex_response {block}", f"ok mac 0 echo 0 error 0 cyclic 2 noncyclic 0 data1 0{shown} {block[16:]}"),
            (f"rtex_rebuilt {block}", f"ok ok {block}")]


def servo_off(row):
    effective = int(row["effective"])
    return [(f"rtex_servo_off {row['before']} {row['servo_off']}", f"{effective} {effective} 1")]


def update_counter_traces(row):
    tripped = row["tripped"]
    assert row["first_trip"] == next((at for at, it in enumerate(tripped) if it), None)
    text = "ok" + "".join(f" {int(it)}" for it in tripped)
    return [(f"rtex_echo {row['limit']} {' '.join(map(str, row['echoes']))}", text)]


def counter_start(row):
    text = "ok" + "".join(f" {counter}:{code}" for counter, code in zip(row["counter"], row["code"], strict=True))
    return [(f"rtex_counter {row['nop_cycles']} {len(row['counter'])}", text)]


def progress(step, motion=False):
    if step == "pending":
        return " pending"
    if step == "failed":
        return " execution"
    if "rejected" in step:
        return f" {step['rejected']}"
    if "failed" in step:
        return " " + {"not_started": "motion_not_started"}.get(step["failed"], step["failed"])
    done = step["done"]
    if motion:
        return f" ok 0 0 {done['warning']} {done['in_position']}"
    data = done.get("data", done.get("monitor_data")) or 0
    return f" ok {data} {done['index'] or 0} {done['warning']} 0" if "index" in done else f" ok {data} INDEX {done['warning']} 0"


def handshake(row):
    data = row["bytes8_11"] + 8 * "0"
    command = f"rtex_handshake {row['mac_id']} {row['code']} {data} {row['limit']} {row['attributes']} "
    command += " ".join(it or "-" for it in row["responses"])
    sent = data if not row["attributes"] else data[:4] + 12 * "0"
    return [(command, f"ok ok {sent}" + "".join(map(progress, row["expect"])))]


def noncyclic_traces(row):
    request = row["request"]
    assert set(request) == {"code", "mac_id", "type_code", "index"}
    data = (request["type_code"].to_bytes(2, "little") + request["index"].to_bytes(2, "little")).hex() + 8 * "0"
    command = f"rtex_handshake {request['mac_id']} {request['code']} {data} 4294967295 0 " + " ".join(row["responses"])
    said = "".join(map(progress, row["expect"])).replace("INDEX", str(request["index"]))
    return [(command, f"ok ok {data}" + said)]


def sub_traces(row):
    command = f"rtex_sub {row['code']} {row['type_code']} {row['index']} {row['limit']} "
    command += " ".join(it or "-" for it in row["responses"])
    said = "".join(map(progress, row["expect"])).replace("INDEX", str(row["index"]))
    return [(command, f"ok{said}")]


def profile_traces(row):
    command = f"rtex_move {row['mac_id']} {row['type_code']} {row['target']} {row['speed']} {row['limit']} "
    command += f"{row['latch_sel1']} {row['monitor_sel']} " + " ".join(it or "-" for it in row["responses"])
    text = "ok"
    for step, sent in zip(row["expect"], row["sent"], strict=True):
        text += f"{progress(step, motion=True)} {sent}"
        if sent == "17":
            text += f" {row['type_code']} {row['latch_sel1']} {row['monitor_sel']} {row['speed']}"
    return [(command, text)]


ASIC = ("INITIAL", "RING_CONFIG", "READY", "RUNNING")
PHASES = ("PH_INIT", "PH_WAITING", "PH_PREPARE", "PH_START", "PH_RUNNING")
STOPPED = (None, "slave_info_mismatch", "timeout")


def phase_traces(row):
    command, text = "rtex_phases", "ok"
    for step, after in zip(row["steps"], row["after"], strict=True):
        assert set(step) <= {"asic", "slave_info", "tx_ready", "timeout"} and set(after) == {"phase", "fault"}
        info = {"match": 1, "mismatch": 0, None: 2}[step.get("slave_info")]
        command += f" {ASIC.index(step['asic'])},{info},{int(step.get('tx_ready', False))},{int(step.get('timeout', False))}"
        text += f" {PHASES.index(after['phase'])}:{STOPPED.index(after['fault'])}"
    return [(command, text)]


def led(row):
    return [(f"rtex_led {PHASES.index(row['phase'])} {STOPPED.index(row['fault'])} {row['t_ms']}", row["led"])]


def periods_a6n(row):
    pr791 = row["pr791"]
    listed, ok = row["listed"], row["internal_timer_ok"]
    text = f"ok {row['com_ns']} {row['update_ns']} {int(ok)}" if listed else "no_value"
    assert listed or (row["com_ns"] is None and row["update_ns"] is None and not ok)
    return [(f"rtex_periods {row['pr720']} {row['pr721']} {-1 if pr791 is None else pr791}", text)]


def frame_time(row):
    if (axes := row.get("axes")) is not None:
        return [(f"rtex_frame_time axes {axes}", str(row["tf_ns"]))]
    return [(f"rtex_frame_time within {row['com_ns']}", str(row["axes_max_by_line"]))]


def timer_reload(row):
    reload = row["reload"]
    assert row["fits_16_bit"] == (reload is not None and reload < 1 << 16)
    return [(f"rtex_reload {row['timer_hz']} {row['period_ns']}", "no_value" if reload is None else f"ok {reload}")]


def position_step(row):
    old, new, step = row["old"], row["new"], row["step"]
    assert (old + step - new) % (1 << 32) == 0
    return [(f"rtex_step {old} {new}", str(step))]


def position_rate(row):
    within = int(row["within_400M_pulse_per_s"])
    return [(f"rtex_rate {row['step']} {row['update_ns']} {row['gear_num']} {row['gear_den']}", str(within))]


def constants(row):
    value = row["value"]
    return [(f"rtex_constant {row['constant']}", str(value[0] << 8 | value[1] if isinstance(value, list) else value))]

"""RTEX: rows as commands of tests/c/rows_rtex.c."""

CYCLIC = {"NOP": 0, "PP": 1, "CP": 2, "CV": 3, "CT": 4}
NONCYCLIC = {"normal": 0, "reset": 1, "system_id": 2, "homing": 4, "alarm": 5, "parameter": 6, "profile": 7, "monitor": 10}
CONTROL = ("servo_on", "gain_sw", "tl_sw", "homing_ctrl", "hard_stop", "smooth_stop", "pause", "sl_sw", "ex_out2", "ex_out1")
STATUS = ("servo_active", "servo_ready", "alarm", "warning", "torque_limited", "homing_complete", "in_progress", "in_position", "si_mon5",
          "si_mon4", "si_mon3", "si_mon2", "si_mon1", "home", "pot", "not")

LONG = "the 32-byte mode is not in the C interface"
FIELDS = "fields alone; whole blocks are in commands16 and responses16"
SERVICE = "non-cyclic commands are sequenced by the program"
RULES = "timing and memory of the ASIC are the program's"
DRIVE = "the drive's side is not in the C interface"
NOT_IN_C = {
    "bitflips": "what an axis does with them is in axis_traces",
    "commands32": LONG,
    "constants": RULES,
    "control_bits": FIELDS,
    "counter_start": RULES,
    "drive_check": DRIVE,
    "frame_time": RULES,
    "handshake": SERVICE,
    "header_byte0": FIELDS,
    "header_byte1": FIELDS,
    "led": RULES,
    "master_check": "what an axis does with them is in axis_traces",
    "noncyclic_traces": SERVICE,
    "packing": "blocks are bytes",
    "periods_a6n": RULES,
    "phase_traces": RULES,
    "position_rate": RULES,
    "position_step": RULES,
    "profile_traces": SERVICE,
    "responses32": LONG,
    "servo_off": FIELDS,
    "status_flags": FIELDS,
    "sub_traces": SERVICE,
    "timer_reload": RULES,
    "update_counter_traces": RULES,
}


def commands16(row):
    # Bytes 8 to 15 are handed over as they are: what `data` names in them is the program's.
    row.ignore("data")
    assert (row["mode"], row["dir"]) == (16, "cmd")
    block, control = row["hex"], row["control"]
    text = (f"ok mac {row['mac_id']} counter {row['update_counter']} tmg {row['tmg_cnt']} cyclic {CYCLIC[row['cyclic']]} "
            f"noncyclic {NONCYCLIC[row['noncyclic']]} data1 {row['command_data1']} ")
    assert set(control) == set(CONTROL)
    text += " ".join(f"{name} {control[name]}" for name in CONTROL)
    return [(f"rtex_command {block}", f"{text} {block[16:]} ok {block}")]


def responses16(row):
    row.ignore("data")
    assert (row["mode"], row["dir"]) == (16, "rsp")
    block, status = row["hex"], row["status"]
    text = (f"ok mac {row['actual_mac_id']} echo {row['update_counter_echo']} error {row['cmd_error']} cyclic {CYCLIC[row['cyclic']]} "
            f"noncyclic {NONCYCLIC[row['noncyclic']]} data1 {row['response_data1']} ")
    assert set(status) == set(STATUS)
    text += " ".join(f"{name} {status[name]}" for name in STATUS)
    return [(f"rtex_response {block}", f"{text} {block[16:]}")]


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


TOPICS = {"commands16": commands16, "responses16": responses16, "axis_traces": axis_traces}

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

"""The step time sequence: rows as commands of tests/c/rows_sorte.c."""

import re

NOT_IN_C = {
    "pru_step_core_words": "machine code of the PRU, which runs no C",
}


def snake(name):
    return re.sub(r"(?<!^)([A-Z])", r"_\1", name).lower()


def step_trace(row):
    row.ignore("tag", "cnt_raw", "t_4us_cnt", "sync_raw")
    right = f"{row['true_cnt']} {row['true_sync']}" if "true_cnt" in row else "..."
    row.ignore("true_cnt", "true_sync", "exact")
    text = f"{row['t_step']} pru {row['cnt']} {row['sync']} right {right}"
    return [(f"step_next {row['entry']} {row['speed']} {row['prev']}", text)]


def ramp_table(row):
    row.ignore("x", "exact", "truncated", "alt_midpoint_x", "alt_midpoint")
    return [(f"step_ramp {row['i']}", str(row["entry"]))]


def speed_const(row):
    row.ignore("named", "exact_first_entry")
    overflow = row.get("overflow_first_entry")
    end = {None: "...", True: "step_time_overflow", False: "ok"}[overflow]
    return [(f"step_speed {row['f_hz']}", f"ok {row['speed_const']} {end}")]


def params(row):
    row.ignore("n")
    error, exact = row.get("error"), row.get("pru_exact")
    text = snake(error) if error else f"ok {int(exact)}" if exact is not None else "ok ..."
    return [(f"step_params {row['speed']} {row['k']} {row['init_sync']}", text)]


def lines(steps):
    return "".join(f" {entry},{t_step},{cycle},{sync}" for entry, t_step, cycle, sync in steps)


def profile(row):
    # The same hash twice: FNV is enough.
    row.ignore("sha256")
    n, head, tail, last = row["n"], row["head"], row["tail"], row["last"]
    move = f"{n} {row['speed']} {row['k']} {row['init_sync']}"
    text = f"ok {row['accel_steps']} {row['const_steps']} {row['decel_steps']} total {row['total_ns']} head{lines(head)} tail{lines(tail)}"
    text += (f" last {last[0]},{last[1]}" if last else "") + f" zero {row['zero_sync']} above {row['above_3990']} hash {row['fnv1a64']}"
    commands = [(f"step_move {move} 1 {len(head)} {len(tail)}", text)]
    if row["exact"]:
        commands += [(f"step_move {move} 0 {len(head)} {len(tail)}", text),
                     (f"step_duration {row['speed']} {row['k']} {row['init_sync']} {n}", f"ok {row['total_ns']}")]
    return commands


def profile_alt_table(row):
    row.ignore("sha256", "table_name")
    n, head, last = row["n"], row["head"], row["last"]
    table = " ".join(map(str, row["table"]))
    end = (f" last {last[0]},{last[1]}" if last else "")
    return [(f"step_own_ramp {n} {row['speed']} {row['k']} {row['init_sync']} 1 {len(head)} {table}",
             f"{row['total_ns']}{lines(head)}{end} {row['fnv1a64']}")]


def profile_inexact(row):
    n = row["n"]
    move = f"{n} {row['speed']} {row['k']} {row['init_sync']}"
    return [(f"step_listed {move} {as_pru} {n}", lines(row[key])) for as_pru, key in ((1, "pru"), (0, "corrected"))]


def cycle_stream(row):
    row.ignore("sha256")
    n, pulses, cycles, dir_ = row["n"], row["pulses"], row["cycles"], row["dir"]
    first = bytes.fromhex(row["first_64_words_le"])
    words = dict(pulses)
    idle = row["idle_word"]
    for at in range(min(64, cycles)):
        assert int.from_bytes(first[2 * at:2 * at + 2], "little") == int(words.get(at, idle), 16)
    text = f"{idle} ok 1" + "".join(f" {cycle}:{word}" for cycle, word in pulses) + f" hash {row['fnv1a64']}"
    return [(f"step_stream {n} {row['speed']} {row['k']} {row['init_sync']} 1 {dir_} {cycles} {int(row['guard'])}", text)]


def pto_word(row):
    row.ignore("wire_le", "shifted_ns", "start_ticks_5ns")
    if row["op"] == "encode":
        expected = "argument" if row.get("error") else f"ok {row['word']}"
        row.ignore("word")
        return [(f"sorte_pto_of_step {row['sync']} {row['dir']}", expected)]
    kind, word = row.get("kind"), row["word"]
    if error := row.get("error"):
        row.ignore("dir", "sync")
        return [(f"sorte_pto {word}", f"{snake(error)} ...")]
    name = {"disable_driver": "driver_off"}.get(kind, kind)
    return [(f"sorte_pto {word}", f"ok {name} start {row.get('sync') or 0} direction {row.get('dir') or 0}")]


def payload(row):
    words, mask = " ".join(row["device_words"]), row.get("mask")
    if row.get("independent"):
        assert mask is None and row.get("word") is None
        command = f"sorte_payload {words}"
    else:
        command = f"sorte_payload {row['word']} {mask}"
    return [(command, f"ok {row['payload']} ok {words}")]


def microstep(row):
    code = row["profile_code"]
    assert int(row["drv8711_mode_bits"], 2) == code
    text = f"ok {row['microsteps']} {row['steps_per_rev']} {row['quarter_turn']} {row['ten_turns']} {row['ctrl_field']}"
    return [(f"step_microstep {code}", text)]


def tones(row):
    whole, tenth = row["tone_hz"].split(".")
    text = f"{row['fstep_khz_exact']} {row['fstep_khz_2dp']} {row['speed_const']} {row['p125']} {row['p250']} {row['t_step_ns_full_speed']}"
    text += f" ppm {row['ppm_fast_from_ns_truncation']:.3f} {row['move_ns_p125_k1']} {row['move_ns_p250_k1']}"
    return [(f"step_tone {int(whole) * 10 + int(tenth)}", text)]


step_trace_edge = step_trace

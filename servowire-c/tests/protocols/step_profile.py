"""The step time sequence: rows as commands of tests/c/rows_sorte.c."""

import re

STREAM = "a step after another is not in the C interface"
NOT_IN_C = {
    "cycle_stream": STREAM,
    "microstep": "the stepper driver is not in the C interface",
    "payload": "four words a device are the program's",
    "profile_alt_table": "other ramps are not in the C interface",
    "profile_inexact": STREAM,
    "pru_step_core_words": "machine code of the PRU",
    "tones": "names of tones are not in the C interface",
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


def profile(row):
    # The whole move step by step is held by the crate's own rows; in C there is how long it takes.
    row.ignore("accel_steps", "const_steps", "decel_steps", "last", "zero_sync", "above_3990", "head", "tail", "sha256", "fnv1a64")
    if not row["exact"]:
        row.ignore("n", "k", "speed", "init_sync", "total_ns")
        return []
    return [(f"step_duration {row['speed']} {row['k']} {row['init_sync']} {row['n']}", f"ok {row['total_ns']}")]


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


step_trace_edge = step_trace

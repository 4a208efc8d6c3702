#!/usr/bin/env python3
"""Writes constants, handshake, sub_traces, profile_traces and axis_traces for RTEX.

Every number comes from the vendor documents and is written here once more; every expectation is written down by hand
beside the blocks that lead to it. Nothing is taken from the crate.

    python3 traces.py        writes the files beside this script
"""

import json
import pathlib
import struct

HERE = pathlib.Path(__file__).parent
MAC = 11


def write(topic, rows):
    with open(HERE / f"{topic}.jsonl", "w") as out:
        for number, row in enumerate(rows):
            out.write(json.dumps({"id": f"{topic}-{number:04}", **row}) + "\n")


def response(code, counter=0, status=0, data1=0, tail=bytes(8), mac=MAC, error=None):
    """A response block. `tail` is bytes 8-15; `error` makes it an error answer."""
    if error is not None:
        code, tail = code | 0x80, struct.pack("<H6x", error)
    return (bytes([0x80 | (counter & 3) << 5 | mac, code]) + struct.pack("<Hi", status, data1) + tail).hex()


def common(kind, index, data, flags=0):
    """Bytes 8-15 in the layout of reset, system ID, alarm, parameter and monitor."""
    return bytes([kind & 0xFF, flags | kind >> 8]) + struct.pack("<Hi", index, data)


ERR, WNG, BUSY = 0x80, 0x40, 0x10

# SX-DSV02310 and the System Design Guide for Master; alarms as main code and sub code.
CONSTANTS = {
    "code.nop": 0x00, "code.profile_idle": 0x10, "code.profile_start": 0x17, "code.cyclic_position": 0x20,
    "cyclic.nop": 0, "cyclic.pp": 1, "cyclic.cp": 2, "cyclic.cv": 3, "cyclic.ct": 4,
    "noncyclic.normal": 0, "noncyclic.reset": 1, "noncyclic.system_id": 2, "noncyclic.homing": 4,
    "noncyclic.alarm": 5, "noncyclic.parameter": 6, "noncyclic.profile": 7, "noncyclic.monitor": 10,
    "sub.normal": 0, "sub.system_id": 2, "sub.monitor": 10,
    "control.servo_on": 0x0080, "control.gain_sw": 0x0010, "control.tl_sw": 0x0008, "control.homing_ctrl": 0x0004,
    "control.hard_stop": 0x8000, "control.smooth_stop": 0x4000, "control.pause": 0x2000, "control.sl_sw": 0x0800,
    "control.ex_out2": 0x0200, "control.ex_out1": 0x0100,
    "status.servo_active": 0x0080, "status.servo_ready": 0x0040, "status.alarm": 0x0020, "status.warning": 0x0010,
    "status.torque_limited": 0x0008, "status.homing_complete": 0x0004, "status.in_progress": 0x0002,
    "status.in_position": 0x0001, "status.si_mon5": 0x8000, "status.si_mon4": 0x4000, "status.si_mon3": 0x2000,
    "status.si_mon2": 0x1000, "status.si_mon1": 0x0800, "status.home": 0x0400, "status.pot": 0x0200,
    "status.not": 0x0100,
    "execution.err": 0x80, "execution.wng": 0x40, "execution.busy": 0x10,
    "latch.latch_comp1": 1, "latch.latch_comp2": 2,
    "profile.psl": 8, "profile.nsl": 4, "profile.near": 2, "profile.latch_comp1": 1,
    "error.mac_id": 0x0011, "error.direction": 0x0012, "error.cyclic_code": 0x0021, "error.non_cyclic_code": 0x0022,
    "error.cyclic_mode": 0x002E, "error.type_code": 0x0031, "error.argument": 0x0032, "error.feed_forward": 0x0034,
    "alarm.command_step": [27, 4], "alarm.cyclic_data": [86, 0], "alarm.cyclic_code": [86, 1],
    "alarm.update_counter": [86, 2], "alarm.command": [91, 1],
    "type.reset.software": 0x001, "type.reset.attribute_c": 0x011,
    "type.system_id.vendor_name": 0x01, "type.system_id.device_type": 0x05, "type.system_id.model": 0x12,
    "type.system_id.serial_number": 0x13, "type.system_id.software_version": 0x14, "type.system_id.driver_type": 0x15,
    "type.system_id.scale_vendor_id": 0x31, "type.system_id.scale_model_id": 0x32,
    "conventional.system_id.vendor_name": 0x010, "conventional.system_id.model": 0x120,
    "conventional.system_id.scale_model_id": 0x320,
    "type.homing.set_actual_position": 0x21, "type.homing.set_command_position": 0x22, "type.homing.latch_state": 0x50,
    "type.parameter.write": 0x011, "type.profile.relative": 0x11,
    "type.monitor.perr": 0x01, "type.monitor.mpos": 0x04, "type.monitor.aspd": 0x05, "type.monitor.trq": 0x06,
    "type.monitor.apos": 0x07, "type.monitor.ipos": 0x08, "type.monitor.lpos1": 0x09, "type.monitor.lpos2": 0x0A,
    "type.monitor.mspd": 0x0C, "type.monitor.regenerative_load": 0x11, "type.monitor.overload": 0x12,
    "conventional.monitor.perr": 0x101, "conventional.monitor.overload": 0x112,
    "position.max_pulses_per_s": 400_000_000, "ring.most_axes": 32, "block.bytes": 16, "block.bytes32": 32,
    "index.pr7_20": 0x0714, "frame.one_axis_ns": 11_000, "frame.full_ns": 300_000, "led.half_period_ms": 500,
}


def handshakes():
    def row(code, request, responses, expect, limit=1000, attributes=0, note=""):
        return {"code": f"{code:02x}", "mac_id": MAC, "bytes8_11": request.hex(), "limit": limit,
                "attributes": attributes, "responses": responses, "expect": expect, "note": note}

    def done(data, index=None, warning=0):
        return {"done": {"data": data, "index": index, "warning": warning}}

    pending, err = "pending", {"failed": "execution"}
    late = {"failed": "timed_out"}

    def refused(code):
        return {"failed": f"{code:04x}"}

    out = []
    # Reset 1h, system ID 2h, alarm 5h, parameter 6h, monitor Ah: one layout.
    for noncyclic, kind, index, data in [(1, 0x001, 0, 0), (2, 0x01, 1, struct.unpack("<i", b"soni")[0]),
                                         (2, 0x120, 2, 0x63), (5, 0x0C3, 3, 0x0126), (6, 0x011, 0x0719, -1),
                                         (10, 0x07, 0, -123_456)]:
        code = 0x20 | noncyclic
        request = bytes([kind & 0xFF, kind >> 8]) + struct.pack("<H", index)
        good = common(kind, index, data)
        answer = {"done": {"data": data, "index": index, "warning": 0}}
        out += [
            row(code, request, [response(0x20, 0), response(0x20, 1), response(code, 2, tail=good)],
                [pending, pending, answer], note="the echo of the code comes later than that of the counter"),
            row(code, request, [response(code, 0, tail=common(kind, index, data, BUSY)),
                                response(code, 1, tail=common(kind, index, data, WNG))],
                [pending, done(data, index, 1)], note="busy, then executed with a restriction"),
            row(code, request, [response(code, 0, tail=common(kind, index, data, ERR | BUSY))], [err],
                note="ERR counts while Busy is still set"),
            row(code, request, [response(code, 0, tail=common(kind, index, 0, BUSY)),
                                response(code, 1, tail=common(kind, index, 0, ERR))], [pending, err],
                note="ERR after Busy"),
            row(code, request, [response(code, 0, tail=common(kind ^ 1, index, data)),
                                response(code, 1, tail=common(kind ^ 0x100, index, data)),
                                response(code, 2, tail=good)], [pending, pending, answer],
                note="another type code is an older answer, in each of its twelve bits"),
            row(code, request, [response(code, 0, tail=common(kind, index ^ 1, data)),
                                response(code, 1, tail=common(kind, index ^ 0x8000, data)),
                                response(code, 2, tail=good)], [pending, pending, answer],
                note="another index is an older answer"),
            row(code, request, [response(code, 0, tail=common(kind ^ 1, index, data, ERR)),
                                response(code, 1, tail=good)], [pending, answer],
                note="ERR of an older answer"),
            row(code, request, [response(code, 0, error=0x0031)], [refused(0x0031)], note="not accepted"),
            row(code, request, [response(0x20, 0, error=0x0032), response(code ^ 0x10, 1, error=0x0032),
                                response(code, 2, error=0x0032)], [pending, pending, refused(0x0032)],
                note="CMD_Error of another command is not the answer"),
            row(code, request, [response(code, 0, tail=good, mac=MAC ^ 1), "", response(code, 0, tail=good)],
                [pending, pending, answer], note="another drive, and no block at all"),
            row(code, request, [response(0x20), response(0x20), response(0x20)], [pending, pending, late], limit=2,
                note="two update periods are waited, the third is too late"),
        ]
    # Homing 4h: byte 8 type, byte 9 flags and Latch_Comp, byte 10 selections, byte 11 Monitor_Sel.
    request = bytes([0x50, 0, 0x53, 0x09])

    def homing(kind=0x50, flags=0, latch=0, selections=0x53, monitor=0x09, data=4711):
        return response(0x24, 0, tail=bytes([kind, flags | latch, selections, monitor]) + struct.pack("<i", data))

    for other in [{"kind": 0x51}, {"selections": 0x54}, {"selections": 0x63}, {"monitor": 0x0A}]:
        out.append(row(0x24, request, [homing(**other), homing()], [pending, done(4711)],
                       note=f"an older answer: {next(iter(other))}"))
    out += [
        row(0x24, request, [homing(flags=BUSY), homing(flags=ERR | BUSY)], [pending, err], note="busy, then ERR and Busy"),
        row(0x24, request, [homing(latch=3, flags=WNG)], [done(4711, None, 1)], note="Latch_Comp does not disturb"),
        row(0x24, request, [response(0x24, 0, error=0x0031)], [refused(0x0031)]),
    ]
    # Attributes of the alarm that is being issued: Index 0 goes out, the alarm comes back as the index.
    request = bytes([0xC5, 0, 0, 0])
    out += [
        row(0x25, request, [response(0x25, 0, tail=common(0xC5, 0x2601, 0x0101))], [done(0x0101, 0x2601)], attributes=1,
            note="the index echo is part of the answer"),
        row(0x25, request, [response(0x25, 0, tail=common(0xC4, 0x2601, 5)),
                            response(0x25, 1, tail=common(0xC5, 0x2601, 0x0101, BUSY)),
                            response(0x25, 2, tail=common(0xC5, 0x5600, 7))], [pending, pending, done(7, 0x5600)],
            attributes=1, note="the type is compared all the same"),
        row(0x25, request, [response(0x25, 0, tail=common(0xC5, 0x2601, 0x0101))] * 2, [pending, late], limit=1,
            note="asked as an ordinary alarm request it never ends"),
    ]
    return out


def sub_traces():
    def sub(code, kind=0, index=0, data=(0, 0, 0), flags=0):
        return (bytes([flags | code, kind]) + struct.pack("<H3i", index, *data)).hex()

    def row(code, kind, index, responses, expect, limit=1000, note=""):
        return {"code": code, "type_code": kind, "index": index, "limit": limit, "responses": responses,
                "expect": expect, "note": note}

    cmd_err, err, wng, busy = 0x80, 0x40, 0x20, 0x10
    out = []
    for code, kind, index, data in [(2, 0x01, 1, 0x696E6F73), (10, 0x07, 0, -9)]:
        good = sub(code, kind, index, (data, 1, 2))
        answer = {"done": {"data": data, "warning": 0}}
        out += [
            row(code, kind, index, [sub(0), good], ["pending", answer], note="one command later"),
            row(code, kind, index, [sub(code, kind, index, flags=busy), sub(code, kind, index, (data, 0, 0), flags=wng)],
                ["pending", {"done": {"data": data, "warning": 1}}]),
            row(code, kind, index, [sub(code, kind, index, flags=err | busy)], [{"failed": "execution"}]),
            row(code, kind, index, [sub(code, kind ^ 2, index), sub(code, kind, index ^ 0x100), good],
                ["pending", "pending", answer], note="older answers"),
            row(code, kind, index, [sub(code ^ 8, 0, 0x0031, flags=cmd_err), sub(code, 0, 0x0032, flags=cmd_err)],
                ["pending", {"failed": "0032"}], note="refused: type echo 0, error code in the place of the index"),
            row(code, kind, index, ["", good], ["pending", answer], note="no sub block"),
            row(code, kind, index, [sub(0)] * 3, ["pending", "pending", {"failed": "timed_out"}], limit=2),
        ]
    return out


READY, ACTIVE, ALARM, PROGRESS, POSITION = 0x40, 0x80, 0x20, 0x02, 0x01


def profile_traces():
    def profile(status, flags=0, low=0, kind=0x11, selection=0, monitor=0, data=0, **more):
        tail = bytes([kind, flags | low, selection, monitor]) + struct.pack("<i", data)
        return response(0x17, status=ACTIVE | READY | status, tail=tail, **more)

    def idle(status=0, **more):
        return response(0x10, status=ACTIVE | READY | status, **more)

    def row(responses, sent, expect, limit=20, latch_sel1=0, monitor_sel=0, note=""):
        return {"mac_id": MAC, "type_code": 0x11, "target": 70_000, "speed": 5_000, "limit": limit,
                "latch_sel1": latch_sel1, "monitor_sel": monitor_sel, "responses": responses, "sent": sent,
                "expect": expect, "note": note}

    def done(in_position=0, warning=0):
        return {"done": {"in_position": in_position, "warning": warning}}

    p = "pending"
    # `sent`: the non-cyclic code that goes out after each response.
    return [
        row([idle(), profile(PROGRESS), profile(PROGRESS), profile(POSITION)], ["17", "17", "17", "10"], [p, p, p, done(1)],
            note="a motion"),
        row([idle(), profile(0), profile(0), profile(PROGRESS), profile(0)], ["17"] * 4 + ["10"], [p, p, p, p, done()],
            note="In_Progress comes later than the first echo of 17h; the end is not the arrival"),
        row([idle(), profile(POSITION), profile(POSITION), profile(POSITION)], ["17", "17", "17", "10"],
            [p, p, p, {"failed": "not_started"}], limit=3, note="it never starts"),
        row([idle(), profile(0, BUSY), profile(0)], ["17", "17", "10"], [p, p, done()], note="Busy says that it moves"),
        row([idle(), profile(PROGRESS), profile(PROGRESS, WNG), profile(0, WNG)], ["17"] * 3 + ["10"],
            [p, p, p, done(0, 1)]),
        row([idle(PROGRESS), idle(PROGRESS), idle()], ["10", "10", "17"], [p, p, p], note="an older motion goes on"),
        row([response(0x20), response(0x1A), response(0x00), idle()], ["10"] * 3 + ["17"], [p] * 4,
            note="10h must have been seen"),
        row([idle(error=0x0032), idle()], ["10", "17"], [p, p], note="a refused 10h is none"),
        row([response(0x1A)] * 3, ["10"] * 3, [p, p, {"failed": "timed_out"}], limit=2, note="10h is never echoed"),
        row([idle(), profile(0, error=0x0031)], ["17", "10"], [p, {"failed": "0031"}], note="refused at the start"),
        row([idle(), profile(PROGRESS), profile(PROGRESS, error=0x0021), profile(PROGRESS), profile(0)],
            ["17"] * 4 + ["10"], [p, p, p, p, done()], note="CMD_Error of one frame does not end a motion"),
        row([idle(), profile(PROGRESS, ERR)], ["17", "10"], [p, {"failed": "execution"}]),
        row([idle(), profile(PROGRESS, kind=0x10), profile(0, ERR, kind=0x10), profile(PROGRESS), profile(0)],
            ["17"] * 4 + ["10"], [p, p, p, p, done()], note="answers to another type are older"),
        row([idle(), profile(PROGRESS, selection=2, monitor=9), profile(PROGRESS, selection=3, monitor=9, low=1, data=123),
             profile(0, selection=3, monitor=9, low=1, data=123)], ["17"] * 3 + ["10"], [p, p, p, done()],
            latch_sel1=3, monitor_sel=9, note="selections are compared"),
        row([idle(mac=MAC ^ 2), "", idle(), profile(PROGRESS, mac=MAC ^ 2), profile(PROGRESS), profile(0, mac=3),
             profile(0)], ["10", "10", "17", "17", "17", "17", "10"], [p] * 6 + [done()], note="another drive, no block"),
    ]


def axis_traces():
    """Each step: what the caller does, the response that comes, the state after it, and the block that goes out."""
    limits = {"echo": 3, "command_errors": 2, "wait": 4, "ready": 9, "inactive": 5}

    class Trace:
        def __init__(self, mode="CP", gear=(1, 1), **other):
            self.row = {"mac_id": MAC, "mode": mode, "update_ns": 500_000, "gear": list(gear),
                        "limits": {**limits, **other}, "steps": []}
            self.counter = 0
            self.code = {"CP": 0x20, "PP": 0x10, "CV": 0x30, "CT": 0x40}[mode]

        def step(self, status, at=0, state="off", on=0, data1=None, do=None, code=None, echo=None, tail=bytes(8), **more):
            """`on`: Servo_On of the block that goes out; `data1`: its Command_Data1, the position unless said."""
            echo = self.counter if echo is None else echo
            answer = None if status is None else response(code or self.code, echo, status, at, tail, **more)
            self.counter = (self.counter + 1) % 4
            head = bytes([self.counter << 5 | MAC, self.code, on << 7, 0])
            value = (at if self.code == 0x20 else 0) if data1 is None else data1
            sent = head + struct.pack("<i", value)
            self.row["steps"].append({"do": do, "response": answer, "state": state, "sent": sent.hex()})
            return self

        def start(self, at=0):
            """Two steps to Off, then servo on and the first period of On."""
            self.step(READY, at, "off").step(READY, at, "off")
            self.step(READY, at, "switching_on", 1, do="switch_on")
            self.step(READY | ACTIVE, at, "on", 1)
            return self

        def noted(self, note):
            return {**self.row, "note": note}

    out = []
    t = Trace().step(0, 5, "starting").step(READY, -7, "off").step(READY, 1_000, "off")
    t.step(READY, 1_001, "switching_on", 1, do="switch_on")
    t.step(READY, 1_003, "switching_on", 1).step(READY, 1_002, "switching_on", 1)
    t.step(READY | ACTIVE, 1_002, "on", 1)
    t.step(READY | ACTIVE, 1_005, "on", 1, data1=1_002)
    out.append(t.noted("the command position follows until the servo is on, then it stays"))

    t = Trace().start(100)
    t.step(READY | ACTIVE, 100, "on", 1, data1=100)
    t.step(READY | ACTIVE, 100, "on", 1, data1=200_100, do={"set_position": 200_100})
    t.step(READY | ACTIVE, 100, "on", 1, data1=200_100, do={"refused_position": 400_101})
    t.step(READY | ACTIVE, 100, "on", 1, data1=100, do={"set_position": 100})
    out.append(t.noted("200 000 units in 0.5 ms at gear 1/1, not one more"))

    t = Trace(gear=(3, 2)).start(0)
    t.step(READY | ACTIVE, 0, "on", 1, data1=133_333, do={"set_position": 133_333})
    t.step(READY | ACTIVE, 0, "on", 1, data1=133_333, do={"refused_position": 266_667})
    out.append(t.noted("gear 3/2: 133 333 units"))

    t = Trace().start(2**31 - 1)
    t.step(READY | ACTIVE, 2**31 - 1, "on", 1, data1=-(2**31) + 9, do={"set_position": -(2**31) + 9})
    out.append(t.noted("across the wrap-around"))

    t = Trace().start(10).step(READY | ACTIVE | ALARM, 12, "stopped:alarm")
    t.step(ALARM, 20, "stopped:alarm").step(READY, 21, "stopped:alarm").step(READY, 22, "starting", do="clear").step(READY, 23, "off")
    out.append(t.noted("an alarm, and clearing"))

    t = Trace().start(0).step(ACTIVE, 3, "stopped:not_ready")
    out.append(t.noted("Servo_Ready falls"))
    t = Trace().start(0).step(READY, 3, "stopped:not_active")
    out.append(t.noted("Servo_Active falls by itself"))

    t = Trace().step(READY, 0, "off").step(READY | ALARM, 0, "stopped:alarm")
    out.append(t.noted("an alarm with the servo off"))
    t = Trace().step(READY, 0, "off").step(0, 0, "starting").step(READY, 0, "off")
    out.append(t.noted("Servo_Ready falls with the servo off"))
    t = Trace().step(READY, 0, "off").step(READY, 0, "switching_on", 1, do="switch_on")
    t.step(READY | ALARM, 4, "stopped:alarm")
    out.append(t.noted("an alarm while switching on"))

    t = Trace()
    for _ in range(9):
        t.step(0, 0, "starting")
    t.step(0, 0, "stopped:ready_timeout")
    out.append(t.noted("nine update periods for Servo_Ready"))
    t = Trace().step(READY, 0, "off").step(READY, 0, "switching_on", 1, do="switch_on")
    for _ in range(4):
        t.step(READY, 0, "switching_on", 1)
    t.step(READY, 0, "stopped:active_timeout")
    out.append(t.noted("four update periods for Servo_Active"))
    t = Trace().start(0).step(READY | ACTIVE, 1, "switching_off", do="switch_off")
    for k in range(5):
        t.step(READY | ACTIVE, k, "switching_off")
    t.step(READY | ACTIVE, 9, "stopped:inactive_timeout")
    out.append(t.noted("five update periods for Servo_Active to fall"))
    t = Trace().start(0).step(READY | ACTIVE, 1, "switching_off", do="switch_off")
    t.step(READY, 2, "off")
    out.append(t.noted("switched off"))

    t = Trace().start(0)
    last = t.counter
    t.step(READY | ACTIVE, 0, "on", 1, echo=last)
    for _ in range(2):
        t.step(READY | ACTIVE, 0, "on", 1, echo=last)
    t.step(READY | ACTIVE, 0, "stopped:echo_timeout", echo=last)
    out.append(t.noted("the echo stands still for three"))
    t = Trace().start(0)
    for _ in range(2):
        t.step(None, 0, "on", 1)
    t.step(READY | ACTIVE, 0, "on", 1)
    for _ in range(2):
        t.step(None, 0, "on", 1)
    t.step(None, 0, "stopped:echo_timeout")
    out.append(t.noted("no blocks: two are borne, three are not"))
    t = Trace().start(0)
    for _ in range(2):
        t.step(READY | ACTIVE, 0, "on", 1, mac=MAC ^ 8)
    t.step(READY | ACTIVE, 0, "stopped:wrong_mac_id:3", mac=MAC ^ 8)
    out.append(t.noted("the blocks of drive 3"))

    t = Trace().start(0)
    t.step(READY | ACTIVE, 0, "on", 1, error=0x0034).step(READY | ACTIVE, 0, "on", 1)
    t.step(READY | ACTIVE, 0, "on", 1, error=0x0034)
    t.step(READY | ACTIVE, 0, "stopped:command_error:0034", error=0x0034)
    out.append(t.noted("CMD_Error once is borne, twice in a row is not"))

    for mode, rate in [("CV", -70_000), ("CT", 55)]:
        t = Trace(mode).start(40)
        t.step(READY | ACTIVE, 40, "on", 1, data1=rate, do={"set_rate": rate})
        t.step(READY | ACTIVE | ALARM, 41, "stopped:alarm")
        out.append(t.noted("the rate is 0 again"))
    t = Trace().start(6).step(READY | ACTIVE, 6, "on", 1, do={"set_control": 0xFFFF ^ 0x0080})
    t.row["steps"][-1]["sent"] = (bytes([t.counter << 5 | MAC, 0x20, 0x9C, 0xEB]) + struct.pack("<i", 6)).hex()
    t.step(READY | ACTIVE, 6, "switching_off", do="switch_off")
    t.row["steps"][-1]["sent"] = (bytes([t.counter << 5 | MAC, 0x20, 0x1C, 0xEB]) + struct.pack("<i", 6)).hex()
    out.append(t.noted("control bits never bring Servo_On or reserved bits with them"))
    t = Trace().step(READY, 0, "off", do={"set_control": 0xFFFF})
    t.row["steps"][-1]["sent"] = (bytes([t.counter << 5 | MAC, 0x20, 0x1C, 0xEB]) + struct.pack("<i", 0)).hex()
    out.append(t.noted("Servo_On asked for by a control bit"))
    t = Trace().start(0)
    t.step(READY | ACTIVE, 0, "stopped:requested", do="stop").step(READY | ACTIVE, 0, "stopped:requested", do="switch_on")
    out.append(t.noted("stopped by the caller"))
    return out


write("constants", [{"constant": name, "value": value} for name, value in CONSTANTS.items()])
write("handshake", handshakes())
write("sub_traces", sub_traces())
write("profile_traces", profile_traces())
write("axis_traces", axis_traces())

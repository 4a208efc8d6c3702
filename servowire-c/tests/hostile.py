#!/usr/bin/env python3
"""A C program that calls every function of the header as nobody should.

    tests/hostile.py HEADER > hostile.c

Each function is called with NULL for every pointer and for each alone, with states that are zeroed, of another kind, copied, or somebody
else's, with buffers of exactly the length that is told, from 0 on, and with numbers at the ends of their ranges, times that go back and
wrap among them: in an order that a seed makes. The program ends with 1 if a call

* takes a NULL or a state that was not started,
* changes something although it was refused at the border (SW_E_NULL to SW_E_NOT_FREE),
* gives a result without a text;

what is undefined shows in the sanitizers and, of the library, in a build of it with theirs and with its arithmetic checked.
"""

import re
import sys

sys.dont_write_bytecode = True

# Lengths beside pointers to arrays: the parameter that tells it.
LENGTHS = ("len", "size", "count", "rx_len", "tx_size", "output_len")
# Its ends hold the address of their queue: there is one of each, which is never copied.
PINNED = ("sw_motion_queue_t", "sw_motion_axis_t", "sw_motion_timer_t")
# Arrays whose length is told in another way: what they hold, by the parameter that is between 0 and 80.
SHAPES = {("sw_aformat_parse_line", "bytes"): ("bits", "((size_t)bits + 7) / 8"), ("sw_tformat_parse_line", "bytes"): ("bits", "((size_t)bits + 7) / 8"),
          ("sw_sorte_build_device_frame", "payload"): (None, "3")}
SHAPES |= {(f"sw_aformat_{call}", name): ("count", f"(size_t)count * sizeof(*{name})") for call in ("hear", "device_hear", "procedure_hear")
           for name in ("contents", "framed")}
SHAPES |= {(f"sw_aformat_{call}", "bytes"): ("count", "((size_t)count + 7) / 8") for call in ("crc8", "crc3")}
# Arrays of states: no buffer of bytes.
STATES_IN_A_ROW = {("sw_rtex_ring_update", "axes")}
# May be NULL.
OPTIONAL = {("sw_hdsl_sampled", "rssi"), ("sw_step_check", "pru_is_exact"), ("sw_tformat_value", "ready_ns"),
            ("sw_aformat_value", "ready_ns"), ("sw_rtex_axis_hear", "bytes"), ("sw_rtex_handshake_hear", "bytes"), ("sw_rtex_sub_hear", "bytes"),
            ("sw_rtex_move_hear", "bytes"), ("sw_rtex_ring_update", "rx"), ("sw_step_shape", "table"), ("sw_step_steps", "table")}


def parameters(text):
    for part in filter(None, (it.strip() for it in " ".join(text.split()).split(","))):
        if part == "void":
            continue
        if array := re.fullmatch(r"(?:(const) )?(\w+) \(\*(\w+)\)\[(\d+)\]", part):
            const, type_, name, length = array.groups()
            yield {"type": type_, "pointer": True, "const": bool(const), "name": name, "array": int(length)}
            continue
        it = re.fullmatch(r"(?:struct )?(const )?(?:struct )?(\w+) (\*?)(\w+)", part)
        if it is None:
            sys.exit(f"hostile.py: not understood: {part}")
        const, type_, star, name = it.groups()
        yield {"type": type_, "pointer": bool(star), "const": bool(const), "name": name, "array": 0}


def functions(header):
    bare = re.sub(r"/\*.*?\*/", "", header, flags=re.S)
    for result, name, text in re.findall(r"^((?:const )?\w+ \*?)(sw_\w+)\(([^;{]*)\);", bare, flags=re.M):
        yield result.strip(), name, list(parameters(text))


def states(header):
    bare = re.sub(r"/\*.*?\*/", "", header, flags=re.S)
    return re.findall(r"typedef struct(?: \w+)? \{\s*uint64_t _private\[\d+\];\s*\} (\w+);", bare)


PROLOGUE = r"""/* Made by tests/hostile.py. */
#include "servowire.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static uint64_t seed;
static unsigned long calls, good, refused, faults;

static uint64_t any(void)
{
    seed ^= seed << 13;
    seed ^= seed >> 7;
    seed ^= seed << 17;
    return seed;
}

static uint64_t now = 1000000;

/* A time: mostly a little later, sometimes an end of the range. */
static uint64_t any_time(void)
{
    static const uint64_t ends[] = {0, 1, INT64_MAX - 1, INT64_MAX, (uint64_t)INT64_MAX + 1, UINT64_MAX - 1, UINT64_MAX, UINT32_MAX,
                                    (uint64_t)UINT32_MAX + 1, UINT64_MAX / 1000};
    uint64_t it = any();
    if (it % 8 == 0) {
        return ends[it / 8 % (sizeof ends / sizeof *ends)];
    }
    if (it % 64 == 1) {
        now = ends[it / 64 % (sizeof ends / sizeof *ends)];
    }
    now += it / 64 % 100000;
    return now;
}

static uint64_t any_number(void)
{
    static const uint64_t ends[] = {0, 1, 2, 3, 7, 8, 15, 16, 23, 31, 32, 63, 64, 127, 128, 255, 256, 1023, 65535, 65536, 0x7fffffff, 0x80000000,
                                    0xfffffffe, 0xffffffff, 2500000, 4000000, 1000000, 500000, 100000, 170000000, INT64_MAX, UINT64_MAX};
    uint64_t it = any();
    return it % 4 == 0 ? any() : it % 4 == 1 ? it / 4 % 12 : ends[it / 4 % (sizeof ends / sizeof *ends)];
}

static void wrong(const char *name, const char *what, long long r)
{
    if (++faults <= 20) {
        fprintf(stderr, "%s: %s (%lld)\n", name, what, r);
    }
}

static void *block(size_t len)
{
    uint8_t *it = malloc(len ? len : 1);
    size_t k;
    if (it == NULL) {
        exit(2);
    }
    for (k = 0; k < len; k++) {
        it[k] = (uint8_t)any();
    }
    return it;
}

static void judged(const char *name, sw_result_t r)
{
    calls++;
    if (r < 0) {
        refused++;
        if (strcmp(sw_text(r), "unknown") == 0) {
            wrong(name, "a refusal without a text", r);
        }
    } else {
        good++;
    }
}

static int at_the_border(sw_result_t r) { return r <= SW_E_NULL && r >= SW_E_NOT_FREE; }
"""


def declared(param):
    return f"{'const ' if param['const'] else ''}{param['type']} *{param['name']}"


def generate(header):
    kinds = states(header)
    out = [PROLOGUE]
    for kind in kinds:
        out.append(f"static {kind} pool_{kind}[4];")
    out.append("")
    names = []
    for result, name, params in functions(header):
        if name in ("sw_text", "sw_version"):
            continue
        # A call with the pointers that `nulls` names as NULL; `zeroed`: states that were not started.
        begins = {param["name"] for param in params if param["pointer"] and not param["const"] and (
            re.search(r"_(start|init|start_\w+)$", name) or param["type"].endswith("_procedure_t") and not re.search(STEPS, name))}
        body = [f"static void call_{name}(unsigned nulls, int zeroed)", "{"]
        arguments, frees, checks, watch = [], [], [], []
        pointers = [param for param in params if param["pointer"]]
        lens = {}
        for at, param in enumerate(params):
            if param["pointer"] and at + 1 < len(params) and params[at + 1]["name"] in LENGTHS and not params[at + 1]["pointer"]:
                lens[param["name"]] = params[at + 1]["name"]
        for (call, pointer), (length, _) in SHAPES.items():
            if call == name and length:
                lens[f"of {pointer}"] = length
        for param in params:
            if not param["pointer"]:
                value = "any_time()" if re.search(r"_ns$|^now$", param["name"]) and param["type"] == "uint64_t" else "any_number()"
                if param["name"] in lens.values():
                    value = "any() % 4 == 0 ? any() % 5 : any() % 80"
                if param["type"] == "bool":
                    value = "any() & 1"
                body.append(f"    {param['type']} {param['name']} = ({param['type']})({value});")
        for at, param in enumerate(pointers):
            name_, type_ = param["name"], param["type"]
            size = f"sizeof({type_})"
            if param["array"]:
                size += f" * {param['array']}"
            if (name, name_) in SHAPES:
                size = SHAPES[name, name_][1]
            elif name_ in lens:
                size += f" * {lens[name_]}"
            is_state = type_ in kinds and (name, name_) not in STATES_IN_A_ROW
            if (name, name_) in STATES_IN_A_ROW:
                body.append(f"    {type_} *{name_} = pool_{type_};")
                body.append(f"    {lens[name_]} = (size_t)(any() % 5);")
            elif is_state and type_ in PINNED:
                body.append(f"    {type_} *{name_} = &pool_{type_}[0];")
            elif is_state:
                body.append(f"    {type_} {name_}_zeroed;")
                body.append(f"    {type_} *{name_} = zeroed ? &{name_}_zeroed : &pool_{type_}[any() % 4];")
                body.append(f"    {type_} {name_}_before;")
                watch.append((name_, size, True))
            else:
                body.append(f"    {type_} *{name_} = block({size});")
                body.append(f"    uint8_t *{name_}_before = block({size});")
                frees += [f"{name_}", f"{name_}_before"]
                if not param["const"]:
                    watch.append((name_, size, False))
        for param in pointers:
            if param["type"] in kinds and (name, param["name"]) not in STATES_IN_A_ROW and param["type"] not in PINNED:
                body.append(f"    memset(&{param['name']}_zeroed, 0, sizeof {param['name']}_zeroed);")
        for name_, size, state in watch:
            body.append(f"    memcpy({'&' if state else ''}{name_}_before, {name_}, {size});")
        for at, param in enumerate(pointers):
            pointer = f"(nulls >> {at} & 1) ? NULL : "
            shape = "(void *)" if param["array"] else ""
            arguments.append(f"{pointer}{shape}{param['name']}")
        order = iter(arguments)
        said = ", ".join(next(order) if param["pointer"] else param["name"] for param in params)
        if result == "sw_result_t":
            body.append(f"    sw_result_t r = {name}({said});")
            body.append(f'    judged("{name}", r);')
            for name_, size, state in watch:
                body.append(f"    if (at_the_border(r) && memcmp({'&' if state else ''}{name_}_before, {name_}, {size}) != 0) {{")
                body.append(f'        wrong("{name}", "refused, and {name_} has changed", r);')
                body.append("    }")
            required = sum(1 << at for at, param in enumerate(pointers) if (name, param["name"]) not in OPTIONAL)
            if required:
                body.append(f"    if ((nulls & {required}u) != 0 && r >= 0) {{")
                body.append(f'        wrong("{name}", "takes a NULL", r);')
                body.append("    }")
            if any(param["type"] in kinds and param["type"] not in PINNED and param["name"] not in begins and
                   (name, param["name"]) not in STATES_IN_A_ROW for param in pointers):
                body.append("    if (zeroed && r >= 0) {")
                body.append(f'        wrong("{name}", "takes a state that was not started", r);')
                body.append("    }")
        else:
            body.append(f"    calls++;")
            body.append(f"    (void){name}({said});")
            if result == "bool" and pointers and not name.endswith("_is_lost"):
                body[-1] = f"    bool r = {name}({said});"
                body.append(f"    if (r && (nulls != 0 || zeroed)) {{")
                body.append(f'        wrong("{name}", "is true of a NULL or a state that was not started", r);')
                body.append("    }")
        for it in frees:
            body.append(f"    free({it});")
        if not pointers:
            body.append("    (void)nulls;")
        if "zeroed" not in "\n".join(body[2:]):
            body.append("    (void)zeroed;")
        body.append("}")
        # Declarations before statements: C99 does not ask for it, and the reader neither.
        out += body + [""]
        names.append((name, len(pointers)))
    out.append("static const struct {\n    void (*call)(unsigned, int);\n    unsigned pointers;\n} all[] = {")
    out += [f"    {{call_{name}, {pointers}}}," for name, pointers in names]
    out.append("};\n")
    copies = [kind for kind in kinds if kind not in PINNED]
    out.append("/* A copy of a state of its kind, or one that lies where another has stood. */\nstatic void muddle(void)\n{\n    uint64_t it = any();")
    out.append(f"    switch (it % {2 * len(copies)}) {{")
    for at, kind in enumerate(copies):
        other = copies[(at + 7) % len(copies)]
        out.append(f"    case {2 * at}:\n        pool_{kind}[it / 64 % 4] = pool_{kind}[it / 256 % 4];\n        break;")
        out.append(f"    case {2 * at + 1}: {{\n        size_t len = sizeof(pool_{kind}[0]) < sizeof(pool_{other}[0]) ? sizeof(pool_{kind}[0]) : "
                   f"sizeof(pool_{other}[0]);\n        if (it / 64 % 16 == 0) {{\n            memcpy(&pool_{kind}[it / 1024 % 4], &pool_{other}[0], len);\n"
                   "        }\n        break;\n    }")
    out.append("    default:\n        break;\n    }\n}\n")
    out.append(r"""int main(int argc, char **argv)
{
    unsigned long rounds = argc > 1 ? strtoul(argv[1], NULL, 10) : 1000, round;
    size_t f;
    unsigned p;
    seed = argc > 2 ? strtoull(argv[2], NULL, 10) : 20261127;
    for (f = 0; f < sizeof all / sizeof *all; f++) {
        all[f].call(~0u, 0);
        all[f].call(~0u, 1);
        for (p = 0; p < all[f].pointers; p++) {
            all[f].call(1u << p, 0);
            all[f].call(1u << p, 1);
        }
        all[f].call(0, 1);
    }
    for (round = 0; round < rounds; round++) {
        for (f = 0; f < sizeof all / sizeof *all; f++) {
            size_t g = any() % (sizeof all / sizeof *all);
            all[g].call(any() % 32 == 0 ? (unsigned)any() : 0, any() % 64 == 0);
        }
        muddle();
    }
    printf("hostile: %u functions, %lu calls, %lu good, %lu refused, %lu faults\n", (unsigned)(sizeof all / sizeof *all), calls, good, refused,
           faults);
    return faults != 0;
}
""")
    return "\n".join(out)


# The other calls with a procedure begin one.
STEPS = r"_(next|value|detected|procedure_\w+)$"


def main():
    header = open(sys.argv[1]).read()
    print(generate(header))


if __name__ == "__main__":
    main()

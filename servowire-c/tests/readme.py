#!/usr/bin/env python3
"""The two examples of README.md as a program, with nothing around them but a timer, a motor and an encoder that answers.

    tests/readme.py README.md > readme.c

Each has 15 lines at most in its calls; the program runs through a wrap of the timer, and the outputs go off when the cable is cut.
"""

import re
import sys

sys.dont_write_bytecode = True

AROUND = r"""#include "servowire.h"

#include <stdio.h>

static uint32_t TIMER = 0xfffff000u;
static const uint32_t POLE_PAIRS = 4, OFFSET = 0;
static int commutated, switched_off, logged;
static uint8_t sent, sent_len;

static void log_error(const char *text) { logged += text[0] != 0; }
static void set_field(uint32_t angle) { commutated += angle == (3915817u << 9) * POLE_PAIRS + OFFSET; }
static void outputs_off(void) { switched_off++; }
static void send(const uint8_t *bytes, uint8_t len)
{
    sent = bytes[0];
    sent_len = len;
}
"""

MAIN = r"""
int main(void)
{
    static const uint8_t answer[11] = {0x1a, 0x00, 0x29, 0xc0, 0x3b, 0x17, 0x00, 0x00, 0x00, 0x00, 0xdf};
    uint8_t damaged[11];
    uint32_t abs = 0;
    int k;
    for (k = 0; k < 11; k++) {
        damaged[k] = answer[k];
    }
    damaged[3] ^= 1;
    if (!angle_of_answer(answer, 11, &abs) || abs != 3915817 || angle_of_answer(damaged, 11, &abs) || angle_of_answer(answer, 10, &abs) ||
        angle_of_answer(NULL, 11, &abs) || logged != 3) {
        return 1;
    }
    setup();
    control_loop(); /* nothing was heard yet */
    if (commutated != 0 || switched_off != 1 || sent != 0x1a || sent_len != 1) {
        return 2;
    }
    for (k = 0; k < 400000; k++) { /* 40 s: the timer wraps */
        TIMER += 170 * 52;
        received(answer, 11);
        TIMER += 17000 - 170 * 52;
        control_loop();
    }
    if (commutated != 400000 || switched_off != 1) {
        return 3;
    }
    for (k = 0; k < 10; k++) { /* the cable is cut: off at 250 us */
        TIMER += 17000;
        control_loop();
    }
    if (switched_off < 8 || commutated > 400003) {
        return 4;
    }
    puts("README: good");
    return 0;
}
"""


def main():
    blocks = re.findall(r"```c\n(.*?)```", open(sys.argv[1]).read(), flags=re.S)
    if len(blocks) != 2:
        sys.exit("readme.py: two examples are expected")
    for block in blocks:
        for body in re.findall(r"^\{\n(.*?)^\}", block, flags=re.S | re.M):
            if body.count("\n") > 15:
                sys.exit("readme.py: more than 15 lines")
    print(AROUND + "".join(block.replace('#include "servowire.h"\n', "") for block in blocks) + MAIN, end="")


if __name__ == "__main__":
    main()

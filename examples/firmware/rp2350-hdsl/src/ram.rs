//! The program runs from RAM: a miss of the flash cache takes many clocks, which would fall within a frame.

use core::arch::global_asm;

// Copies the program before any of it is called; in assembler, because it must itself be in flash and call nothing.
global_asm!(
    ".section .boot, \"ax\"",
    ".global __pre_init",
    ".type __pre_init, %function",
    ".thumb_func",
    "__pre_init:",
    "ldr r0, =__shot",
    "ldr r1, =__ehot",
    "ldr r2, =__sihot",
    "1:",
    "cmp r0, r1",
    "beq 2f",
    "ldm r2!, {{r3}}",
    "stm r0!, {{r3}}",
    "b 1b",
    "2:",
    "bx lr",
    ".ltorg",
);

; Replays step_core.s in the GNU simulator: reads records of three words (ramp entry, speed constant, previous
; sync_time) from standard input until it ends, and writes six words for each (r17..r22) to standard output.
;
; In the simulator HALT is a call to the host: r1 = number (1 exit, 4 read, 5 write), r14..r16 = arguments,
; r14 = result. rebuild.sh puts the core in the place marked below, with its HALT turned into a jump.

        .text
        .globl  _start
_start:
next:
        ldi     r1, 4                   ; read(0, 256, 12)
        ldi     r14, 0
        ldi     r15, 256
        ldi     r16, 12
        halt
        qbeq    record, r14, 12
        ldi     r1, 1                   ; exit(0)
        ldi     r14, 0
        halt
record:
        ldi     r2, 256
        lbbo    &r14, r2, 0, 12
        .include "core.inc"
        ldi     r2, 512
        sbbo    &r17, r2, 0, 24
        ldi     r1, 5                   ; write(1, 512, 24)
        ldi     r14, 1
        ldi     r15, 512
        ldi     r16, 24
        halt
        jmp     next

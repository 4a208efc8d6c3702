; Step time of one axis: Table 2 of TIDEP0061, section 2.3.2, with the adjustment of 4us_cnt.
;
; in   r14 ramp entry, 1000 / sin^2      out  r17 t_step in ns
;      r15 speed constant, 2^16 / f[MHz]      r18 4us_cnt before the adjustment
;      r16 previous sync_time in ns           r19 4us_cnt in ns
;                                             r20 sync_time before the adjustment
;                                             r21 4us_cnt
;                                             r22 sync_time
;
; The multiplier samples r28 and r29 on every clock, and its product can be read one instruction after
; that: Table 2 leaves out the instruction that has to stand between the last operand and XIN.

        .text
        .globl  _start
_start:
        ldi     r25, 0                  ; multiply only, no accumulation
        xout    0, r25.b0, 1
        mov     r28, r14
        mov     r29, r15
        nop                             ; the multiplier samples the operands
        xin     0, r26.b0, 8            ; ns * 2^16
        mov     r28.w0, r26.w2          ; bits 47..16 of the product: t_step
        mov     r28.w2, r27.w0
        ldi     r29.w0, 25166           ; 1073742 = 2^32 / 4000, rounded up
        ldi     r29.w2, 16
        mov     r17, r28
        add     r23, r28, r16           ; previous sync_time + t_step
        xin     0, r26.b0, 8
        mov     r18, r27                ; product / 2^32: 4us_cnt
        mov     r29, r27
        ldi     r28, 4000
        mov     r21, r27
        xin     0, r26.b0, 8            ; 4us_cnt in ns
        mov     r19, r26
        sub     r29, r23, r26           ; sync_time
        mov     r20, r29
        qbgt    done, r29, r28          ; 4000 > sync_time: it lies in this cycle
        sub     r29, r29, r28
        add     r21, r21, 1
done:
        mov     r22, r29
        halt

/* The runner of the rows: a command with its arguments is called through the C interface, and what it gives is text. */
#ifndef ROWS_H
#define ROWS_H

#include "servowire.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A block of exactly its length, so that a sanitizer sees a byte read after it. */
typedef struct {
    uint8_t *at;
    size_t len;
} block_t;

/* `text` has the arguments, blank between them; `say` is where the answer goes. */
typedef void command_t(char **arguments, int count);

typedef struct {
    const char *name;
    command_t *call;
} entry_t;

extern const entry_t tformat_commands[], aformat_commands[], aformat_more_commands[], hdsl_commands[], hdsl_link_commands[],
    rtex_commands[], rtex_more_commands[], sorte_commands[];

void say(const char *format, ...);
uint64_t number(const char *text);       /* decimal, or hexadecimal after 0x; - is 0 */
#define U8(text) ((uint8_t)number(text))
#define U16(text) ((uint16_t)number(text))
#define U32(text) ((uint32_t)number(text))
int64_t signed_number(const char *text);
block_t hex(const char *text);           /* bytes; - for none */
block_t packed(const char *text);        /* 0 and 1, the first of the line in bit 0 */
void say_hex(const uint8_t *bytes, size_t len);
void say_bits(const uint8_t *bytes, size_t bits);
uint64_t line_bits(const char *text);    /* 0 and 1, the first of the line in bit 0 */
void say_line(uint64_t bits, unsigned len);

#endif

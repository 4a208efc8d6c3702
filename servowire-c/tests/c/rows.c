/* Reads lines `NAME<tab>COMMAND ARGUMENTS...<tab>EXPECTED`, calls the command, and compares. Says what differs, and how many rows
 * passed and failed; a run without rows fails. */
#include "rows.h"

static char answer[262144];
static size_t said;
static void *blocks[64];
static int held;

void say(const char *format, ...)
{
    va_list list;
    int n;
    va_start(list, format);
    n = vsnprintf(answer + said, sizeof answer - said, format, list);
    va_end(list);
    if (n < 0 || (size_t)n >= sizeof answer - said) {
        fputs("rows: the answer is too long\n", stderr);
        exit(2);
    }
    said += (size_t)n;
}

static void *keep(size_t len)
{
    void *block = malloc(len ? len : 1);
    if (block == NULL || held == 64) {
        exit(2);
    }
    blocks[held++] = block;
    return block;
}

uint64_t number(const char *text) { return strcmp(text, "-") == 0 ? 0 : strtoull(text, NULL, 0); }
int64_t signed_number(const char *text) { return strtoll(text, NULL, 0); }

block_t hex(const char *text)
{
    block_t block;
    size_t k;
    block.len = strcmp(text, "-") == 0 ? 0 : strlen(text) / 2;
    block.at = keep(block.len);
    for (k = 0; k < block.len; k++) {
        char byte[3] = {text[2 * k], text[2 * k + 1], 0};
        block.at[k] = (uint8_t)strtoul(byte, NULL, 16);
    }
    return block;
}

block_t packed(const char *text)
{
    block_t block;
    size_t k, bits = strcmp(text, "-") == 0 ? 0 : strlen(text);
    block.len = (bits + 7) / 8;
    block.at = keep(block.len);
    memset(block.at, 0, block.len);
    for (k = 0; k < bits; k++) {
        block.at[k / 8] = (uint8_t)(block.at[k / 8] | (text[k] == '1' ? 1u << k % 8 : 0u));
    }
    return block;
}

void say_hex(const uint8_t *bytes, size_t len)
{
    size_t k;
    say(" ");
    for (k = 0; k < len; k++) {
        say("%02x", bytes[k]);
    }
}

void say_bits(const uint8_t *bytes, size_t bits)
{
    size_t k;
    say(" ");
    for (k = 0; k < bits; k++) {
        say("%d", bytes[k / 8] >> k % 8 & 1);
    }
}

static command_t *find(const char *name)
{
    static const entry_t *const tables[] = {tformat_commands, aformat_commands, aformat_more_commands, hdsl_commands, hdsl_link_commands,
        rtex_commands, rtex_more_commands, sorte_commands};
    size_t k;
    for (k = 0; k < sizeof tables / sizeof *tables; k++) {
        const entry_t *entry;
        for (entry = tables[k]; entry->name != NULL; entry++) {
            if (strcmp(entry->name, name) == 0) {
                return entry->call;
            }
        }
    }
    return NULL;
}

/* Whether the row is as it should be. */
static int run(char *line)
{
    char *arguments[1024];
    char *name = strtok(line, "\t"), *command = strtok(NULL, "\t"), *expected = strtok(NULL, "\n"), *word;
    command_t *call;
    int count = 0;
    if (name == NULL || command == NULL || expected == NULL) {
        fprintf(stderr, "rows: not a row: %s\n", line);
        return 0;
    }
    for (word = strtok(command, " "); word != NULL && count < 1024; word = strtok(NULL, " ")) {
        arguments[count++] = word;
    }
    call = find(arguments[0]);
    said = 0;
    answer[0] = 0;
    if (call == NULL) {
        say("no command %s", arguments[0]);
    } else {
        call(arguments + 1, count - 1);
    }
    while (held > 0) {
        free(blocks[--held]);
    }
    /* Behind three dots the row says nothing. */
    word = strstr(expected, "...");
    if (word != NULL ? strncmp(answer, expected, (size_t)(word - expected)) == 0 : strcmp(answer, expected) == 0) {
        return 1;
    }
    fprintf(stderr, "%s: %s\n  expected: %s\n  real:     %s\n", name, arguments[0], expected, answer);
    return 0;
}

int main(void)
{
    static char line[262144];
    unsigned long passed = 0, failed = 0;
    while (fgets(line, sizeof line, stdin) != NULL) {
        if (strchr(line, '\n') == NULL) {
            fputs("rows: a line is too long\n", stderr);
            return 2;
        }
        if (run(line)) {
            passed++;
        } else {
            failed++;
        }
    }
    printf("%lu passed, %lu failed\n", passed, failed);
    return failed > 0 || passed == 0;
}

/* A-format. */
#include "rows.h"

static void say_response(sw_result_t r, const sw_aformat_response_t *it)
{
    say("%s", sw_text(r));
    if (r == SW_OK) {
        say(" layout %u command %u ea %u es %u abs %llu velocity %d data %u alm %u acceleration %d temperature %u pm_alm %u address %u bank %u",
            it->layout, it->command, it->ea, it->es, (unsigned long long)it->abs, it->velocity, it->data, it->alm, it->acceleration,
            it->temperature, it->pm_alm, it->address, it->bank);
    }
}

/* COMMAND LAYOUT EA BITS */
static void line(char **a, int n)
{
    sw_aformat_response_t it;
    block_t bits = packed(a[3]);
    sw_result_t r;
    (void)n;
    r = sw_aformat_parse_line(U8(a[0]), U8(a[1]), U8(a[2]), bits.at,
                              strcmp(a[3], "-") == 0 ? 0 : strlen(a[3]), SW_LSB_FIRST, &it);
    say_response(r, &it);
}

static uint16_t *words_of(char **a, int n)
{
    /* Of exactly their length. */
    uint16_t *words = malloc(n > 0 ? (size_t)n * sizeof *words : 1);
    int k;
    if (words == NULL) {
        exit(2);
    }
    for (k = 0; k < n; k++) {
        words[k] = (uint16_t)strtoul(a[k], NULL, 16);
    }
    return words;
}

/* The call for one message, where there is one, says the same. */
static void typed(char **a, const uint16_t *heard, size_t count, sw_result_t r, const sw_aformat_response_t *it)
{
    sw_aformat_abs40_t data = {0, 0, 0};
    if (U8(a[1]) == SW_AFORMAT_ABS40 && (U8(a[0]) == 0 || U8(a[0]) == 4)) {
        sw_result_t same = sw_aformat_parse_abs40(U8(a[0]), U8(a[2]), heard, count, SW_MSB_FIRST, &data);
        if (same != r || (r == SW_OK && (data.abs != it->abs || data.ea != it->ea || data.es != it->es))) {
            say(" the typed call differs");
        }
    }
}

/* COMMAND LAYOUT EA WORDS... */
static void words(char **a, int n)
{
    sw_aformat_response_t it;
    size_t count = (size_t)(n - 3);
    uint16_t *heard = words_of(a + 3, n - 3);
    sw_result_t r = sw_aformat_parse_as(U8(a[0]), U8(a[1]), U8(a[2]), heard, count, SW_MSB_FIRST, &it);
    say_response(r, &it);
    typed(a, heard, count, r, &it);
    free(heard);
}

static sw_aformat_request_t asked_of(char **a)
{
    sw_aformat_request_t asked = {U32(a[5]), U8(a[0]), U8(a[1]), U8(a[2]), U8(a[3]), U8(a[4])};
    return asked;
}

/* COMMAND EA FC ADDRESS BANK DATA OPTIONS WORDS...: with all that a request tells. */
static void asked(char **a, int n)
{
    sw_aformat_request_t request = asked_of(a);
    sw_aformat_encoder_t encoder = {20, 16, U8(a[6])};
    sw_aformat_response_t it;
    uint16_t *heard = words_of(a + 7, n - 7);
    sw_result_t r;
    r = sw_aformat_parse(&request, &encoder, heard, (size_t)(n - 7), SW_MSB_FIRST, &it);
    free(heard);
    say("%s", sw_text(r));
}

/* COMMAND EA FC ADDRESS BANK DATA OPTIONS: the frames, and with what an encoder answers. */
static void build(char **a, int n)
{
    sw_aformat_request_t request = asked_of(a);
    sw_aformat_encoder_t encoder = {20, 16, U8(a[6])};
    uint16_t frames[5];
    uint8_t layout = 99, size = 0;
    size_t count = 0, k;
    (void)n;
    say("%s", sw_text(sw_aformat_build(&request, SW_MSB_FIRST, frames, 5, &count)));
    for (k = 0; k < count; k++) {
        say(" %04x", frames[k]);
    }
    say(" %s", sw_text(sw_aformat_layout(&request, &encoder, &layout, &size)));
    say(" %u %u", layout, size);
}

/* KIND(read, write, reset) EA COMMAND ADDRESS DATA, then an answer each: WORD,WORD... or - for none. What is sent, how long after the end of
 * the answer before, and the end. */
static void procedure(char **a, int n)
{
    static const sw_aformat_encoder_t encoder = {20, 16, 0};
    uint8_t ea = U8(a[1]), address = U8(a[3]);
    uint64_t now = 1000000, ended = 0;
    sw_aformat_t m;
    sw_aformat_procedure_t p;
    sw_aformat_transmission_t tx;
    uint32_t value = 0;
    sw_result_t r;
    int k;
    (void)sw_aformat_init(&m, 4000000, &encoder);
    r = strcmp(a[0], "read") == 0    ? sw_aformat_eeprom_read(&p, &m, ea, address, 0, now)
        : strcmp(a[0], "write") == 0 ? sw_aformat_eeprom_write(&p, &m, ea, address, U16(a[4]), 0, now)
                                     : sw_aformat_reset(&p, &m, U8(a[2]), ea, 0, now);
    say("%s", sw_text(r));
    for (k = 5; (r = sw_aformat_next(&p, now, &tx)) == SW_SEND; k++) {
        uint16_t *answer, count = 0;
        char *word;
        if (ended != 0) {
            say(" %llu", (unsigned long long)(tx.start_ns - ended) / 1000);
        }
        say(" ");
        for (count = 0; count < tx.len; count++) {
            say("%04x%s", tx.contents[count], count + 1 < tx.len ? "," : "");
        }
        if (k >= n) {
            say(" and no answer is left");
            return;
        }
        answer = (uint16_t *)(void *)hex("000000000000000000000000").at;
        count = 0;
        for (word = a[k]; *word != '-' && count < 6; word += strlen(word) > 4 ? 5 : 4) {
            if (strlen(word) < 4) {
                break;
            }
            answer[count++] = (uint16_t)strtoul(word, NULL, 16);
        }
        if (count > 0) {
            ended = now = tx.end_ns + 3000 + count * 4500u;
            say(" %s", sw_text(sw_aformat_procedure_hear(&p, answer, NULL, count, now)));
        } else {
            ended = now = sw_aformat_procedure_until_ns(&p);
            say(" %s", sw_text(sw_aformat_procedure_poll(&p, now)));
        }
    }
    say(" %s", sw_text(r));
    if (sw_aformat_value(&p, &value, NULL) == SW_OK) {
        say(" %u", value);
    }
}

const entry_t aformat_commands[] = {
    {"aformat_line", line}, {"aformat_words", words}, {"aformat_asked", asked}, {"aformat_build", build},
    {"aformat_procedure", procedure}, {NULL, NULL},
};

/* A-format: frames alone, check values, lines of bits and samples, what raw values mean. */
#include "rows.h"

/* FC MEMORY EA COMMAND BYTE: the line, its word of 32 bits, and the frame read back. */
static void frame(char **a, int n)
{
    sw_aformat_frame_t it = {U8(a[0]), U8(a[1]), U8(a[2]), U8(a[3]), U8(a[4])}, back;
    uint32_t bits = 0, word = 0;
    (void)n;
    say("%s", sw_text(sw_aformat_build_frame(&it, &bits)));
    say_line(bits, 18);
    say(" %s", sw_text(sw_aformat_build_word32(&it, &word)));
    say(" %08x %s", word, sw_text(sw_aformat_parse_frame(bits, 18, &back)));
    if (it.memory) {
        say(" %u %u", back.fc, back.byte);
    } else {
        say(" %u %u %u", back.fc, back.ea, back.command);
    }
}

/* A request whose arguments do not matter. */
static void in_version(char **a, int n)
{
    sw_aformat_request_t asked = {0, U8(a[0]), 0, U8(a[1]), 0, 0};
    static const sw_aformat_encoder_t old = {20, 16, 0}, new = {20, 16, SW_AFORMAT_VERSION_3_0};
    (void)n;
    say("%s", sw_text(sw_aformat_check(&asked, &old)));
    say(" %s", sw_text(sw_aformat_check(&asked, &new)));
}

static void parse_frame(char **a, int n)
{
    sw_aformat_frame_t it;
    uint32_t len = strcmp(a[0], "-") == 0 ? 0 : (uint32_t)strlen(a[0]);
    sw_result_t r = sw_aformat_parse_frame((uint32_t)line_bits(a[0]), len, &it);
    (void)n;
    say("%s", sw_text(r));
    if (r == SW_OK) {
        say(" %u %u %u %u", it.fc, it.ea, it.command, it.byte);
    }
}

/* COMMAND EA FC ADDRESS BANK DATA VERSION_3: whether it can be asked for at all. */
static void checked(char **a, int n)
{
    sw_aformat_request_t asked = {U32(a[5]), U8(a[0]), U8(a[1]), U8(a[2]), U8(a[3]), U8(a[4])};
    sw_aformat_encoder_t encoder = {20, 16, 0};
    encoder.options = U8(a[6]) ? SW_AFORMAT_VERSION_3_0 : 0;
    (void)n;
    say("%s", sw_text(sw_aformat_check(&asked, &encoder)));
}

/* crc8 or crc3, the order of bits (0 LSB), COUNT, HEX */
static void crc(char **a, int n)
{
    block_t bytes = hex(a[3]);
    uint8_t it = 0;
    (void)n;
    say("%s", sw_text(strcmp(a[0], "crc8") == 0 ? sw_aformat_crc8(bytes.at, (size_t)number(a[2]), U8(a[1]), &it)
                                                : sw_aformat_crc3(bytes.at, (size_t)number(a[2]), U8(a[1]), &it)));
    say(" %x", it);
}

/* LAYOUT COMMAND SAMPLES_PER_BIT COUNT HEX (the first sample in bit 7): the words that are received, and what they say. */
static void received(char **a, int n)
{
    block_t bytes = hex(a[4]);
    size_t at, count = 0, k, samples = (size_t)number(a[3]);
    sw_aformat_receiver_t it;
    uint16_t words[SW_AFORMAT_FRAMES];
    (void)n;
    say("%s", sw_text(sw_aformat_receiver_start(&it, U8(a[0]), U32(a[2]), true)));
    for (at = 0; at < samples; at++) {
        sw_result_t r = sw_aformat_receiver_push(&it, bytes.at[at / 8] >> (7 - at % 8) & 1, words, SW_AFORMAT_FRAMES, &count);
        if (r == SW_PENDING) {
            continue;
        }
        say(" %s", sw_text(r));
        if (r == SW_OK) {
            sw_aformat_response_t response;
            for (k = 0; k < count; k++) {
                say(" %04x", words[k]);
            }
            say(" %s", sw_text(sw_aformat_parse_as(U8(a[1]), U8(a[0]), 255, words, count, SW_MSB_FIRST, &response)));
        }
    }
}

/* COMMAND LAYOUT ENCODERS BITS */
static void bus(char **a, int n)
{
    sw_aformat_bus_t it;
    sw_aformat_receiver_t receiver;
    uint8_t count = U8(a[2]);
    sw_aformat_request_t asked = {0, U8(a[0]), (uint8_t)(count - 1), 0, 0, 0};
    sw_aformat_encoder_t encoder = {20, 16, SW_AFORMAT_VERSION_3_0};
    sw_result_t r;
    const char *bit;
    int k;
    (void)n;
    say("%s", sw_text(sw_aformat_bus_start(&it, &asked, &encoder, (uint8_t)((1u << count) - 1))));
    say(" %s", sw_text(sw_aformat_receiver_start(&receiver, U8(a[1]), 1, false)));
    for (bit = a[3]; *bit != 0; bit++) {
        sw_aformat_response_t response;
        memset(&response, 0, sizeof response);
        r = sw_aformat_bus_sample(&it, &receiver, *bit == '1', &response);
        if (r == SW_PENDING) {
            continue;
        }
        say(" %s", r == SW_E_AFORMAT_TWO_RESPONSES ? "duplicate" : sw_text(r));
        if (r == SW_OK || r == SW_E_AFORMAT_TWO_RESPONSES) {
            say(" ea %u es %u abs %llu alm %u temperature %u velocity %d acceleration %d", response.ea, response.es,
                (unsigned long long)response.abs, response.alm, response.temperature, response.velocity, response.acceleration);
        }
    }
    r = sw_aformat_bus_line_ends(&it, &receiver);
    if (r != SW_OK) {
        say(" %s", sw_text(r));
    }
    for (k = sw_aformat_bus_not_started(&it); k > 0; k--) {
        say(" missing");
    }
}

static sw_result_t parsed(char **a, char **words, int n, sw_aformat_response_t *it)
{
    uint16_t heard[8];
    int k;
    memset(it, 0, sizeof *it);
    for (k = 0; k < n && k < 8; k++) {
        heard[k] = (uint16_t)strtoul(words[k], NULL, 16);
    }
    return sw_aformat_parse_as(U8(a[0]), U8(a[1]), 255, heard, (size_t)n, SW_MSB_FIRST, it);
}

/* COMMAND LAYOUT SINGLE TURNS WORDS...: who answers what, and whether single turn and turns are so with some width that there is. */
static void anchor(char **a, int n)
{
    static const unsigned widths[] = {17, 20, 22, 24};
    sw_aformat_response_t it;
    int fits = strcmp(a[2], "-") == 0;
    size_t k;
    say("%s", sw_text(parsed(a, a + 4, n - 4, &it)));
    for (k = 0; k < 4; k++) {
        fits |= (it.abs & ((1u << widths[k]) - 1)) == number(a[2]) && it.abs >> widths[k] == number(a[3]);
    }
    say(" ea %u cc %u es %u fits %d abs %llu", it.ea, it.command, it.es, fits, (unsigned long long)it.abs);
}

/* COMMAND LAYOUT WORDS...: what another driver shows of a reply. */
static void peer(char **a, int n)
{
    sw_aformat_response_t it;
    uint32_t milli = 0;
    say("%s", sw_text(parsed(a, a + 2, n - 2, &it)));
    say(" ea %u es %u", it.ea, it.layout == SW_AFORMAT_ABS17 ? it.es != 0 : it.es);
    if (it.layout == SW_AFORMAT_STATUS) {
        say(" alm %u", it.alm);
    } else if (it.layout == SW_AFORMAT_TEMP && sw_aformat_milli_celsius(it.temperature, &milli) == SW_OK) {
        say(" whole_degrees %u", milli / 1000);
    } else if (it.layout == SW_AFORMAT_ID) {
        say(" data %u", it.data);
    }
}

/* ALM VERSION_3 */
static void alarm(char **a, int n)
{
    uint16_t alm = U16(a[0]);
    (void)n;
    say("%u %u", alm & sw_aformat_known_alarms(U8(a[1]) == 1), sw_aformat_es_of_alarms(alm));
}

static void temperature(char **a, int n)
{
    uint32_t plain = 0;
    int32_t twos = 0;
    (void)n;
    say("%s", sw_text(sw_aformat_milli_celsius(U16(a[0]), &plain)));
    say(" %u %s", plain, sw_text(sw_aformat_signed_milli_celsius(U16(a[0]), &twos)));
    say(" %d", twos);
}

static void type(char **a, int n)
{
    sw_aformat_type_t it;
    (void)n;
    say("%s", sw_text(sw_aformat_parse_type(U16(a[0]), &it)));
    say(" %u %u %u %u", it.resolution_code, it.st_bits, it.mt_bits, it.battery);
}

/* ST MT LOW24 HIGH24 SINGLE TURNS */
static void math(char **a, int n)
{
    sw_aformat_encoder_t encoder = {U8(a[0]), U8(a[1]), 0};
    uint64_t joined = 0, composed = 0;
    uint32_t milli = 0;
    (void)n;
    say("%s", sw_text(sw_aformat_join(U32(a[2]), U32(a[3]), &joined)));
    say(" %llu", (unsigned long long)joined);
    say(" %s", sw_text(sw_aformat_compose(&encoder, U32(a[4]), U32(a[5]), &composed)));
    say(" %llu", (unsigned long long)composed);
    say(" %s", sw_text(sw_aformat_milli_degrees(&encoder, U32(a[4]), &milli)));
    say(" %u", milli);
}

/* RATE LAYOUT */
static void times(char **a, int n)
{
    sw_aformat_times_t it;
    (void)n;
    say("%s", sw_text(sw_aformat_times(U32(a[0]), U8(a[1]), 8, &it)));
    say(" %u %u %u %u %u %u", it.bit_ps, it.response_ns, it.frame_ns, it.one_ns, it.gap_ns, it.all_ns);
}

const entry_t aformat_more_commands[] = {
    {"aformat_frame", frame}, {"aformat_in_version", in_version}, {"aformat_parse_frame", parse_frame}, {"aformat_check", checked},
    {"aformat_crc", crc}, {"aformat_received", received}, {"aformat_bus", bus}, {"aformat_anchor", anchor}, {"aformat_peer", peer}, {"aformat_alarm", alarm},
    {"aformat_temperature", temperature}, {"aformat_type", type}, {"aformat_math", math}, {"aformat_times", times}, {NULL, NULL},
};

#include <servowire.h>
#include <string.h>

int main(void)
{
    static const uint8_t heard[] = {0x02, 0x20, 0xb4, 0xbd, 0x1c, 0x37};
    sw_tformat_single_turn_t data;
    return !(sw_tformat_parse_single_turn(heard, sizeof heard, &data) == SW_OK && data.abs == 1883572 && strcmp(sw_text(-1), "null_pointer") == 0);
}

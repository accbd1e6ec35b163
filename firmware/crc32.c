/* CRC-32, half a byte at a time: 64 bytes of table. */
#include "crc32.h"

uint32_t crc32_of(uint32_t crc, const uint8_t *data, uint32_t length)
{
    static const uint32_t half_bytes[16] = {
        0x00000000u, 0x1DB71064u, 0x3B6E20C8u, 0x26D930ACu, 0x76DC4190u, 0x6B6B51F4u, 0x4DB26158u, 0x5005713Cu,
        0xEDB88320u, 0xF00F9344u, 0xD6D6A3E8u, 0xCB61B38Cu, 0x9B64C2B0u, 0x86D3D2D4u, 0xA00AE278u, 0xBDBDF21Cu};
    crc = ~crc;
    while (length > 0u) {
        crc = half_bytes[(crc ^ *data) & 15u] ^ crc >> 4;
        crc = half_bytes[(crc ^ (uint32_t)*data >> 4) & 15u] ^ crc >> 4;
        data++;
        length--;
    }
    return ~crc;
}

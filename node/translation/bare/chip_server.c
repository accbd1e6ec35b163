/* The step of one node on a bare chip that a host speaks to: records come and go through two files of the host.
 *
 * A request: kind and length (int32), then the bytes. The chip keeps the node's record; after a step or an aiding it
 * answers with what the step returned (int64) and its record. It ends with its host. */
#include <stdio.h>

#include "borechain_step.h"

enum { NODE, SETTINGS, PARAMETERS, STEP, AIDING };

static struct borechain_node node;
static struct borechain_settings settings;
static struct borechain_parameters parameters[1 + BORECHAIN_IMUS];
static struct {
    int64_t moment[8];
    int64_t readings[BORECHAIN_IMUS][20];
} cycle;
static int64_t aiding[12];
static char read_ahead[65536], written[65536];

static int take(void *place, size_t room, int32_t length, FILE *from)
{
    return length >= 0 && (size_t)length <= room && fread(place, 1, (size_t)length, from) == (size_t)length;
}

static int answer(int64_t said, FILE *to)
{
    return fwrite(&said, sizeof said, 1, to) == 1 && fwrite(&node, sizeof node, 1, to) == 1 && fflush(to) == 0;
}

static int serve(int32_t kind, int32_t length, FILE *from, FILE *to)
{
    switch (kind) {
    case NODE:
        return take(&node, sizeof node, length, from);
    case SETTINGS:
        return take(&settings, sizeof settings, length, from);
    case PARAMETERS:
        return take(parameters, sizeof parameters, length, from);
    case STEP:
        return take(&cycle, sizeof cycle, length, from)
            && answer(borechain_step(&node, &settings, parameters, cycle.readings, cycle.moment), to);
    case AIDING:
        return take(aiding, sizeof aiding, length, from) && answer(borechain_aiding(&node, &settings, aiding), to);
    default:
        return 0;
    }
}

int main(void)
{
    FILE *from = fopen("to_chip", "rb"), *to = fopen("from_chip", "wb");
    int32_t head[2];
    if (from == NULL || to == NULL) {
        return 1;
    }
    setvbuf(from, read_ahead, _IOFBF, sizeof read_ahead);
    setvbuf(to, written, _IOFBF, sizeof written);
    while (fread(head, sizeof head[0], 2, from) == 2 && serve(head[0], head[1], from, to)) {
    }
    return 0;
}

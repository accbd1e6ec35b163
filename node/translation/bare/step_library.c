/* The step of one node as a library of a Linux board: what is called by names that do not change.
 *
 * The header has the records, and the digest of its source in the names that the linker sees: a library of another
 * header does not come about. What loads it asks what its records are before the first step. */
#include "borechain_step.h"

const int64_t library_layout[5] = {BORECHAIN_LAYOUT, BORECHAIN_IMUS, sizeof(struct borechain_node),
    sizeof(struct borechain_settings), sizeof(struct borechain_parameters)};

int64_t library_step(struct borechain_node *node, struct borechain_settings *settings,
    struct borechain_parameters parameters[1 + BORECHAIN_IMUS], int64_t readings[BORECHAIN_IMUS][20], int64_t moment[8])
{
    return borechain_step(node, settings, parameters, readings, moment);
}

int64_t library_aiding(struct borechain_node *node, struct borechain_settings *settings, int64_t aiding[12])
{
    return borechain_aiding(node, settings, aiding);
}

/* Payloads of others that wait for their next hop, see chip_relays.h. */
#include "chip_relays.h"

#include <stddef.h>
#include <string.h>

#define MOST_STATES (NODE_RELAYS / 2u)

static bool is_free(const struct chip_node *node, const struct node_relay *one)
{
    return one->length == 0u || (!one->is_state && !link_holds(&node->ends[one->side].link, one->payload));
}

/* A place with the payload in it; NULL where none is free. */
static struct node_relay *keep(
    struct chip_node *node, enum node_side to, const uint8_t *payload, uint32_t length, bool is_state)
{
    uint32_t k;
    for (k = 0u; k < NODE_RELAYS && length <= NODE_RELAY_ROOM; k++) {
        struct node_relay *const one = &node->relays[k];
        if (is_free(node, one)) {
            memcpy(one->payload, payload, length);
            one->length = (uint16_t)length;
            one->side = (uint8_t)to;
            one->is_state = is_state;
            return one;
        }
    }
    return NULL;
}

bool relay_pass(struct chip_node *node, enum node_side to, const uint8_t *payload, uint32_t length)
{
    struct node_relay *const one = keep(node, to, payload, length, false);
    return one != NULL && link_send(&node->ends[to].link, one->payload, length);
}

void relay_pass_state(struct chip_node *node, const uint8_t *payload, uint32_t length)
{
    uint32_t k, waiting = 0u;
    for (k = 0u; k < NODE_RELAYS; k++) {
        waiting += node->relays[k].is_state && node->relays[k].length > 0u ? 1u : 0u;
    }
    if (waiting < MOST_STATES) {
        (void)keep(node, NODE_UPPER, payload, length, true);
    }
}

uint32_t relay_take_state(struct chip_node *node, uint8_t *room, uint32_t size)
{
    uint32_t k;
    for (k = 0u; k < NODE_RELAYS; k++) {
        struct node_relay *const one = &node->relays[k];
        if (one->is_state && one->length > 0u) {
            const uint32_t length = one->length <= size ? one->length : 0u;
            memcpy(room, one->payload, length);
            one->length = 0u;
            return length;
        }
    }
    return 0u;
}

void relay_drop_states(struct chip_node *node)
{
    uint32_t k;
    for (k = 0u; k < NODE_RELAYS; k++) {
        if (node->relays[k].is_state) {
            node->relays[k].length = 0u;
        }
    }
}

bool relay_has_room(const struct chip_node *node, enum node_side to)
{
    uint32_t k;
    for (k = 0u; k < NODE_RELAYS; k++) {
        if (is_free(node, &node->relays[k])) {
            return node->ends[to].link.count < LINK_SLOTS;
        }
    }
    return false;
}

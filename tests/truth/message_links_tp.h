/* The two tracepoints as tracetools 8.10 defines them. */
#undef LTTNG_UST_TRACEPOINT_PROVIDER
#define LTTNG_UST_TRACEPOINT_PROVIDER ros2
#undef LTTNG_UST_TRACEPOINT_INCLUDE
#define LTTNG_UST_TRACEPOINT_INCLUDE "./message_links_tp.h"
#if !defined(MESSAGE_LINKS_TP_H) || defined(LTTNG_UST_TRACEPOINT_HEADER_MULTI_READ)
#define MESSAGE_LINKS_TP_H
#include <lttng/tracepoint.h>
#include <stddef.h>
#include <stdint.h>
#define MESSAGE_LINK(name) LTTNG_UST_TRACEPOINT_EVENT(ros2, name, \
    LTTNG_UST_TP_ARGS(const void **, subs_arg, size_t, num_subs_arg, \
                      const void **, pubs_arg, size_t, num_pubs_arg), \
    LTTNG_UST_TP_FIELDS( \
        lttng_ust_field_sequence_hex(uint64_t, subs, (const uint64_t *)subs_arg, size_t, num_subs_arg) \
        lttng_ust_field_sequence_hex(uint64_t, pubs, (const uint64_t *)pubs_arg, size_t, num_pubs_arg)))
MESSAGE_LINK(message_link_periodic_async)
MESSAGE_LINK(message_link_partial_sync)
#endif
#include <lttng/tracepoint-event.h>

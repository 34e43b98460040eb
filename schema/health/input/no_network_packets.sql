-- title: A kernel trace without network packets
-- description: The trace of a kernel has no packets of the network, which would help to bring the
--     clocks of hosts together.
-- cause: The events of the network were not enabled.
-- cure: Enable net_dev_queue and net_if_receive_skb on every host (docs/clocks.md).
-- grain: one row per trace
-- severity: info
-- when: staging.source WHERE domain = 'kernel'
SELECT
    s.trace_index + 1 AS trace_id,
    1 AS count,
    'the kernel trace has no network packets, which would help to synchronise the clocks: enable '
    || 'net_dev_queue and net_if_receive_skb on every host' AS detail
FROM staging.source AS s
ANTI JOIN staging.network_packet AS p ON s.trace_index + 1 = p.trace_id
WHERE s.domain = 'kernel' AND (SELECT count(*) FROM staging.clock) > 1

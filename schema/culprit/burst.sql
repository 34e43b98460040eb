-- title: Messages that come in bursts
-- description: Messages wait for each other, although their callback would be free most of the
--     time. Where only the newest is used later, those that one run of a callback sends at once do
--     no harm: the first is as new as the others.
-- grain: one row per topic and node that takes it
-- reads: breakdown, harm, noticed, thread_load, topic_burst
-- next: query topics --measure rate --topic {topic_name}
SELECT
    4 AS place, b.node, b.callback, b.function, h.path, h.topic_name, h.harm_ns, h.p95_ns, h.lost,
    h.published,
    b.size AS count,
    b.period_ns,
    h.node AS waiting_node,
    h.callback AS waiting_callback,
    [h.node || h.callback, h.node || ' waits'] AS claims
FROM harm AS h
JOIN topic_burst AS b ON h.topic_name = b.topic_name
LEFT JOIN thread_load AS l ON h.node = l.node AND h.callback = l.callback
CROSS JOIN noticed AS n
WHERE h.matters AND h.own_ns > h.direct_ns AND coalesce(l.load, 0) < n.load
    AND NOT (b.is_one_root AND h.path IN (SELECT path FROM breakdown WHERE part = 'cache'))

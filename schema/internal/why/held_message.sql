-- title: Messages that come when the callback ends that publishes them
-- description: Where a callback goes on after it has published, nearly all messages are taken by
--     another thread right after its end. Its executor keeps them, or publish() takes that long.
-- grain: one row per topic and node that takes it
-- reads: callback_name, noticed
-- column: waiting_node VARCHAR  Node that takes the messages
-- column: topic_name VARCHAR  Their topic
-- column: node VARCHAR  Node that publishes most of them
-- column: callback VARCHAR  What triggers the callback that does
SELECT
    d.full_name AS waiting_node,
    s.topic_name, n.node, n.callback
FROM main.link_transport AS l
JOIN main.publication AS b ON l.publication_id = b.publication_id
JOIN main.link_causal AS c ON b.publication_id = c.publication_id AND c.kind = 'direct'
JOIN main.callback_instance AS i ON c.callback_instance_id = i.callback_instance_id
JOIN callback_name AS n ON i.callback_id = n.callback_id
JOIN main.take AS t ON l.take_id = t.take_id
JOIN main.subscription AS s ON t.subscription_id = s.subscription_id
JOIN main.node AS d ON s.node_id = d.node_id
CROSS JOIN noticed AS o
WHERE list_contains($runs, l.run_id)
    AND b.start_ns >= $start_ns AND b.start_ns < $end_ns
    AND i.thread_id <> t.thread_id
    AND i.end_ns - b.end_ns >= o.least_ns
GROUP BY d.full_name, s.topic_name, n.node, n.callback
HAVING count(*) >= any_value(o.lost)
    AND count(*) FILTER (
        WHERE t.taken_ns - i.end_ns BETWEEN 0 AND o.of_path * (i.end_ns - b.end_ns)
    ) >= any_value(o.nearly_all) * count(*)
QUALIFY row_number() OVER (
    PARTITION BY d.full_name, s.topic_name ORDER BY count(*) DESC, n.node, n.callback
) = 1

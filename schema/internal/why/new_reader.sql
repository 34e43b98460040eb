-- title: Callbacks that take longer since somebody gets their messages
-- description: Nearly all calls before a subscription got its first message take less than half of
--     what nearly all since then take, and so do those of the second before and the second after.
-- grain: one row per node and callback
-- reads: callback_name, harm
-- column: node VARCHAR  Node of the callback
-- column: callback VARCHAR  What triggers it
-- column: reader VARCHAR  Node of the subscription
-- column: reader_topic VARCHAR  Its topic
-- column: since_ns BIGINT [ns]  When the call began that published the first message, since the
--     start of the run
-- column: before_ns BIGINT [ns]  Median duration of the calls before
WITH call AS (
    SELECT
        h.node, h.callback, i.callback_instance_id, i.start_ns,
        i.end_ns - i.start_ns AS run_ns
    FROM harm AS h
    JOIN callback_name AS n ON h.node = n.node AND h.callback = n.callback
    JOIN main.callback_instance AS i ON n.callback_id = i.callback_id
    WHERE h.matters AND i.end_ns IS NOT NULL
),
heard AS (
    SELECT
        c.node, c.callback, s.run_id,
        d.full_name AS reader,
        s.topic_name AS reader_topic,
        min(c.start_ns) AS at_ns
    FROM call AS c
    JOIN main.link_causal AS p
        ON c.callback_instance_id = p.callback_instance_id AND p.kind = 'direct'
    JOIN main.link_transport AS l ON p.publication_id = l.publication_id
    JOIN main.take AS t ON l.take_id = t.take_id
    JOIN main.subscription AS s ON t.subscription_id = s.subscription_id
    JOIN main.node AS d ON s.node_id = d.node_id
    GROUP BY ALL
)
SELECT
    h.node, h.callback, h.reader, h.reader_topic,
    h.at_ns - any_value(r.start_ns) AS since_ns,
    quantile_disc(c.run_ns, 0.5) FILTER (c.start_ns < h.at_ns) AS before_ns
FROM heard AS h
JOIN call AS c ON h.node = c.node AND h.callback = c.callback
JOIN main.run AS r ON h.run_id = r.run_id
GROUP BY h.node, h.callback, h.reader, h.reader_topic, h.at_ns
HAVING count(*) FILTER (c.start_ns < h.at_ns) >= 10
    AND count(*) FILTER (c.start_ns >= h.at_ns) >= 10
    AND 2 * greatest(
        quantile_disc(c.run_ns, 0.9) FILTER (c.start_ns < h.at_ns),
        quantile_disc(c.run_ns, 0.5) FILTER (h.at_ns - c.start_ns BETWEEN 1 AND 1e9)
    ) < least(
        quantile_disc(c.run_ns, 0.1) FILTER (c.start_ns >= h.at_ns),
        quantile_disc(c.run_ns, 0.5) FILTER (c.start_ns - h.at_ns BETWEEN 0 AND 1e9)
    )
QUALIFY row_number() OVER (PARTITION BY h.node, h.callback ORDER BY h.at_ns, h.reader) = 1

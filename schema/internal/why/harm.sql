-- title: How much harm callbacks do
-- description: By how much the data at the end of an application path are older because of a
--     callback, which runs on the path or keeps others waiting that do: on the path that it delays
--     most. What stays below all limits (`noticed`) does not matter.
-- grain: one row per node and callback
-- reads: application_path, blame, callback_use, noticed
-- column: node VARCHAR  Node
-- column: callback VARCHAR  What triggers it; NULL: no callback is traced
-- column: function VARCHAR  Its function; NULL: not known
-- column: path VARCHAR [path]  The path that it delays most
-- column: topic_name VARCHAR  Topic whose messages wait for it longest; of callbacks that are not
--     traced, the one that it publishes on
-- column: harm_ns BIGINT [ns]  Mean time by which the data at the end of the path are older
-- column: direct_ns BIGINT [ns]  Part of it: while it runs on the path
-- column: own_ns BIGINT [ns]  Part of it: while further messages wait for it
-- column: p95_ns BIGINT [ns]  95 % of the messages are delayed by no more, at one place
-- column: lost BIGINT  Messages lost while others waited for it
-- column: published BIGINT  Messages on that topic
-- column: waiting_node VARCHAR  Node of another callback that waits for it longest
-- column: waiting_callback VARCHAR  What triggers that
-- column: matters BOOLEAN  It is enough to be told
WITH judged AS (
    SELECT
        b.*, l.least_ns,
        b.waiting_node IS NULL AS is_direct,
        b.waiting_node = b.node AND b.waiting_callback = b.callback AS is_own,
        greatest(coalesce(u.limit_ns, l.late_ns), l.of_path * a.p95_ns) AS limit_ns,
        b.lost >= l.lost AND b.lost >= l.of_messages * b.published AS is_losing
    FROM blame AS b
    JOIN application_path AS a ON b.path = a.path
    LEFT JOIN callback_use AS u
        ON coalesce(b.waiting_node, b.node) = u.node
        AND coalesce(b.waiting_callback, b.callback) = u.callback
    CROSS JOIN noticed AS l
    WHERE b.node IS NOT NULL
),
by_path AS (
    SELECT
        node, callback, path,
        sum(mean_ns)::BIGINT AS harm_ns,
        coalesce(sum(mean_ns) FILTER (WHERE is_direct), 0)::BIGINT AS direct_ns,
        coalesce(sum(mean_ns) FILTER (WHERE is_own), 0)::BIGINT AS own_ns,
        max(p95_ns) AS p95_ns,
        -- What is lost is of one topic.
        coalesce(
            arg_max(topic_name, lost) FILTER (WHERE lost > 0), arg_max(topic_name, mean_ns)
        ) AS topic_name,
        max(lost) AS lost,
        arg_max(published, lost) AS published,
        arg_max(waiting_node, mean_ns) FILTER (WHERE NOT is_direct AND NOT is_own)
            AS waiting_node,
        arg_max(waiting_callback, mean_ns) FILTER (WHERE NOT is_direct AND NOT is_own)
            AS waiting_callback,
        -- Its own messages wait for it, and it runs on the path: both delay them.
        (
            bool_or(p95_ns >= limit_ns OR is_losing)
            OR sum(p95_ns) FILTER (WHERE is_direct OR is_own)
                >= min(limit_ns) FILTER (WHERE is_direct OR is_own)
        )
        AND sum(mean_ns) >= any_value(least_ns) AS matters
    FROM judged
    GROUP BY node, callback, path
)
SELECT
    p.node, p.callback, u.function, p.path, p.topic_name, p.harm_ns, p.direct_ns, p.own_ns,
    p.p95_ns, p.lost, p.published, p.waiting_node, p.waiting_callback,
    coalesce(p.matters, false) AS matters
FROM by_path AS p
LEFT JOIN callback_use AS u ON p.node = u.node AND p.callback = u.callback
QUALIFY row_number() OVER (
    PARTITION BY p.node, p.callback ORDER BY p.matters DESC, p.harm_ns DESC, p.path
) = 1

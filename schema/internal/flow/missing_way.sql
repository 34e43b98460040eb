-- description: A sentence: where flows that start at one place end, and where those begin that
--     arrive at another, if no path leads from the one to the other. Of the nodes where flows end,
--     those count that publish towards the other place. If there are none, those count where a link
--     may be missing (main.dead_end). If there are none either, those that publish count, else all.
-- grain: one row, or none if there is a path
-- param: from VARCHAR[]  Topics or nodes where flows start: names or globs
-- param: to VARCHAR[]  Topics or nodes where they end, likewise
WITH RECURSIVE start_place AS MATERIALIZED (FROM derive.place($runs, $from)),
end_place AS MATERIALIZED (FROM derive.place($runs, $to)),
hop AS MATERIALIZED (
    SELECT
        h.from_subscription_id, h.subscription_id, h.is_source,
        p.node_id AS publishing_id,
        h.from_subscription_id IS NULL
        AND (
            (p.topic_name IN (SELECT topic_name FROM start_place)) IS true
            OR (p.node_id IN (SELECT node_id FROM start_place)) IS true
        ) AS is_start,
        (p.topic_name IN (SELECT topic_name FROM end_place)) IS true
        OR (s.node_id IN (SELECT node_id FROM end_place)) IS true AS is_last
    FROM store.flow_hop AS h
    JOIN store.publisher AS p ON h.publisher_id = p.publisher_id
    JOIN store.subscription AS s ON h.subscription_id = s.subscription_id
    WHERE list_contains($runs, h.run_id)
),
onward (subscription_id, is_last) AS (
    SELECT subscription_id, is_last FROM hop WHERE is_start
    UNION
    SELECT h.subscription_id, h.is_last
    FROM onward AS o
    JOIN hop AS h ON o.subscription_id = h.from_subscription_id
),
back (subscription_id, publishing_id, from_subscription_id, is_source) AS (
    SELECT subscription_id, publishing_id, from_subscription_id, is_source FROM hop WHERE is_last
    UNION
    SELECT h.subscription_id, h.publishing_id, h.from_subscription_id, h.is_source
    FROM back AS b
    JOIN hop AS h ON b.from_subscription_id = h.subscription_id
),
ended AS (
    SELECT
        s.topic_name,
        main.node_label(n.full_name, p.name, p.pid) AS node,
        d.subscription_id IS NOT NULL AS is_dead_end,
        CASE
            WHEN s.node_id IN (SELECT publishing_id FROM back) THEN 1
            WHEN d.subscription_id IS NOT NULL THEN 2
            WHEN s.node_id IN (SELECT node_id FROM store.publisher WHERE NOT is_internal) THEN 3
            ELSE 4
        END AS rank
    FROM (SELECT DISTINCT subscription_id FROM onward) AS o
    ANTI JOIN hop AS h ON o.subscription_id = h.from_subscription_id
    LEFT JOIN (
        SELECT DISTINCT subscription_id FROM main.dead_end($runs) WHERE NOT is_loop
    ) AS d ON o.subscription_id = d.subscription_id
    JOIN store.subscription AS s ON o.subscription_id = s.subscription_id
    JOIN store.process AS p ON s.process_id = p.process_id
    LEFT JOIN store.node AS n ON s.node_id = n.node_id
),
last AS (
    SELECT
        derive.names_in_words(node) AS nodes,
        derive.names_in_words(topic_name) AS topics,
        min(rank) = 1 AS is_joint,
        bool_or(is_dead_end) AS is_dead_end,
        min(rank) = 4 AS is_sink
    FROM ended
    WHERE rank = (SELECT min(rank) FROM ended)
),
first AS (
    SELECT derive.names_in_words(main.node_label(n.full_name, p.name, p.pid)) AS nodes
    -- What a publisher that is not traced sends begins where it is received.
    FROM (
        SELECT DISTINCT b.publishing_id
        FROM back AS b
        ANTI JOIN hop AS h ON b.from_subscription_id = h.subscription_id
        WHERE b.is_source OR b.from_subscription_id IS NOT NULL
    ) AS b
    JOIN store.node AS n ON b.publishing_id = n.node_id
    JOIN store.process AS p ON n.process_id = p.process_id
)
SELECT
    CASE
        WHEN coalesce(l.nodes, '') = ''
            THEN format('no message of {} was received', array_to_string($from, ', '))
        ELSE concat(
            format('flows from {} end at {}', array_to_string($from, ', '), l.nodes),
            format(' (on {}), ', coalesce(nullif(l.topics, ''), '?')),
            CASE
                WHEN l.is_joint THEN 'which publishes towards ' || array_to_string($to, ', ')
                WHEN coalesce(f.nodes, '') = ''
                    THEN 'and nothing arrives at ' || array_to_string($to, ', ')
                ELSE format('and those to {} begin at {}', array_to_string($to, ', '), f.nodes)
            END,
            CASE
                WHEN l.is_dead_end THEN ': msgflow suggest links'
                WHEN NOT l.is_sink THEN ': a link may be missing (msgflow links apply FILE)'
            END
        )
    END AS sentence
FROM last AS l
CROSS JOIN first AS f
WHERE NOT EXISTS (SELECT 1 FROM onward WHERE is_last)

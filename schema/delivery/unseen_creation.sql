-- description: Processes with objects that were used, but were not seen to be created: how many,
--     their kinds, and whether the events of their creation may have been lost. Objects of ROS
--     itself do not count: /rosout is published on handles never initialised.
-- grain: one row per such process
WITH object AS (
    SELECT
        process_id,
        'nodes' AS kind,
        is_inferred
    FROM store.node
    UNION ALL
    SELECT process_id, 'publishers', is_inferred
    FROM store.publisher
    WHERE NOT is_internal
    UNION ALL
    SELECT process_id, 'subscriptions', is_inferred
    FROM store.subscription
    WHERE NOT is_internal
    UNION ALL
    SELECT
        process_id, 'timers',
        created_ns IS NULL
    FROM store.timer
    UNION ALL
    SELECT
        process_id, 'services',
        created_ns IS NULL
    FROM store.service
    UNION ALL
    SELECT
        process_id, 'clients',
        created_ns IS NULL
    FROM store.client
    UNION ALL
    SELECT
        process_id, 'callbacks',
        created_ns IS NULL
    FROM store.callback
),
counted AS (
    SELECT
        process_id, kind,
        sum(is_inferred::BIGINT)::BIGINT AS inferred,
        count(*) AS number
    FROM object
    GROUP BY process_id, kind
)
SELECT
    process_id,
    sum(inferred)::BIGINT AS count,
    'not seen to be created: '
    || string_agg(printf('%d of %d %s', inferred, number, kind), ', ' ORDER BY kind) AS detail,
    process_id IN (SELECT process_id FROM derive.lossy_start) AS is_lossy
FROM counted
WHERE inferred > 0
GROUP BY process_id

-- title: Objects were not seen to be created
-- description: Nodes, publishers, subscriptions, timers, callbacks, clients or services were used
--     whose creation is not in the trace. What they are called is not known, or deduced. Publishers
--     of ROS itself do not count: /rosout is published on handles never initialised.
-- cause: The session was started after the nodes, the events of initialisation were not enabled, or
--     events of that time were lost.
-- cure: See the findings started_late and initialisation_lost, which name the processes.
-- grain: one row per kind with such objects
-- severity: warning
-- when: staging.node WHERE is_inferred, staging.publisher WHERE is_inferred AND NOT is_internal,
--     staging.subscription WHERE is_inferred, staging.timer WHERE created_ns IS NULL,
--     staging.callback WHERE created_ns IS NULL, staging.client WHERE created_ns IS NULL,
--     staging.service WHERE created_ns IS NULL
WITH unseen AS (
    SELECT
        'nodes' AS kind,
        process_id
    FROM staging.node
    WHERE is_inferred
    UNION ALL
    SELECT 'publishers', process_id
    FROM staging.publisher
    WHERE is_inferred AND NOT is_internal
    UNION ALL
    SELECT 'subscriptions', process_id
    FROM staging.subscription
    WHERE is_inferred
    UNION ALL
    SELECT 'timers', process_id
    FROM staging.timer
    WHERE created_ns IS NULL
    UNION ALL
    SELECT 'callbacks', process_id
    FROM staging.callback
    WHERE created_ns IS NULL
    UNION ALL
    SELECT 'clients', process_id
    FROM staging.client
    WHERE created_ns IS NULL
    UNION ALL
    SELECT 'services', process_id
    FROM staging.service
    WHERE created_ns IS NULL
)
SELECT
    u.kind AS subject,
    count(*) AS count,
    'objects that were used but whose initialisation was not traced (tracing started late, or '
    || 'events were lost), in ' || string_agg(DISTINCT l.label, ', ' ORDER BY l.label) AS detail
FROM unseen AS u
JOIN process_label AS l ON u.process_id = l.process_id
GROUP BY u.kind

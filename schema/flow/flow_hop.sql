-- description: Steps of the computation graph that messages really took: from nowhere (a source) or
--     a subscription through a publisher to a subscription, by a route of services
--     (derive.flow_caller) or directly. A step is cached where the message may wait in the node for
--     others (an indirect link).
-- grain: one row per run, subscription before (NULL: source), route, publisher and subscription
CREATE OR REPLACE MACRO derive.flow_hop(only_run) AS TABLE
WITH carried AS (
    SELECT DISTINCT publisher_id, subscription_id FROM derive.flow_transport WHERE run_id = only_run
),
entered AS (
    SELECT
        run_id,
        subscription_id AS from_subscription_id,
        route, publisher_id,
        false AS is_source,
        bool_or(derive.is_indirect(kind)) AS is_cached
    FROM derive.flow_continuation
    WHERE run_id = only_run
    GROUP BY run_id, subscription_id, route, publisher_id
    UNION ALL
    SELECT
        run_id, NULL, route, publisher_id,
        bool_or(is_source),
        false
    FROM store.flow_root
    WHERE run_id = only_run
    GROUP BY run_id, route, publisher_id
)
SELECT
    e.run_id, e.from_subscription_id, e.route, e.publisher_id, c.subscription_id,
    e.is_source, e.is_cached
FROM entered AS e
JOIN carried AS c ON e.publisher_id = c.publisher_id

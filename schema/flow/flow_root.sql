-- name: derive.flow_root
-- kind: macro
-- description: Where the flow of each publication can be said to begin: with the callback
--     instance of the timer (or other callback without a message) that published it, or that
--     called the service that did; else with the publication itself. It is a source if no taken
--     message led to it. The route (derive.flow_caller) starts at the instance that called; if
--     none did, it is empty.
-- grain: one row per publication on a topic of the application
-- needs: store.publication, store.publisher, store.link_causal, store.flow_call,
--     derive.flow_caller
CREATE OR REPLACE MACRO derive.flow_root(only_run) AS TABLE
WITH called AS (
    SELECT run_id, publication_id, publisher_id, caller_id, take_id, route
    FROM store.flow_call AS l
    ANTI JOIN derive.flow_caller AS f ON l.caller_id = f.callback_instance_id
    WHERE l.run_id = only_run
),
message AS (
    SELECT l.publication_id
    FROM store.link_causal AS l
    ANTI JOIN derive.flow_caller AS c ON l.callback_instance_id = c.callback_instance_id
    WHERE l.run_id = only_run AND l.take_id IS NOT NULL
    UNION ALL
    SELECT publication_id FROM called WHERE take_id IS NOT NULL
),
-- Each publication, and once more for each instance that published it or called for it. They are
-- grouped, not joined: what a join looks up stays in memory until the query ends.
run AS (
    SELECT
        run_id, publication_id, publisher_id, NULL::BIGINT AS callback_instance_id,
        NULL::BIGINT[] AS route
    FROM store.publication
    WHERE run_id = only_run
    UNION ALL
    SELECT l.run_id, l.publication_id, l.publisher_id, l.callback_instance_id, NULL
    FROM store.link_causal AS l
    ANTI JOIN derive.flow_caller AS c ON l.callback_instance_id = c.callback_instance_id
    WHERE l.run_id = only_run AND l.take_id IS NULL
    UNION ALL
    SELECT run_id, publication_id, publisher_id, caller_id, route FROM called WHERE take_id IS NULL
),
source AS (
    SELECT
        r.run_id,
        r.publication_id,
        r.publisher_id,
        min(r.callback_instance_id) AS callback_instance_id,
        list({'callback_instance_id': r.callback_instance_id, 'route': r.route})
            FILTER (WHERE r.route IS NOT NULL) AS ways
    FROM run AS r
    JOIN store.publisher AS p ON r.publisher_id = p.publisher_id
    ANTI JOIN message AS m ON r.publication_id = m.publication_id
    WHERE NOT p.is_internal
    GROUP BY r.run_id, r.publication_id, r.publisher_id
)
SELECT
    run_id,
    publication_id,
    publisher_id,
    true AS is_source,
    CASE WHEN callback_instance_id IS NULL THEN 'publication' ELSE 'callback_instance' END
        AS root_kind,
    coalesce(callback_instance_id, publication_id) AS root_id,
    CASE WHEN ways IS NULL THEN []::BIGINT[]
        ELSE coalesce(
            list_min(list_filter(
                ways, lambda way: way.callback_instance_id = source.callback_instance_id
            )).route,
            []
        ) END AS route
FROM source
UNION ALL
SELECT
    b.run_id, b.publication_id, b.publisher_id, false, 'publication', b.publication_id,
    []::BIGINT[]
FROM store.publication AS b
JOIN store.publisher AS p ON b.publisher_id = p.publisher_id
SEMI JOIN message AS m ON b.publication_id = m.publication_id
WHERE b.run_id = only_run AND NOT p.is_internal

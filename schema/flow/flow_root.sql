-- description: Where the flow of each publication can be said to begin: with the callback instance
--     of the timer (or other callback without a message) that published it, or that called the
--     service that did; else with the publication itself. It is a source if no taken message led to
--     it, and it is not the status of an action whose goal is not known. The route
--     (derive.flow_caller) starts at the instance that called; if none did, it is empty. The flow
--     of a message whose publisher is not traced begins with its take, or before that with its
--     stamp, if the clock of the publisher is that of the reader: of all messages that the
--     subscription took, the quickest came neither before its stamp nor later than a message needs.
--     Its publication and its publisher have no rows: the ids of the take and of the subscription
--     stand for them, below 0.
-- grain: one row per publication on a topic of the application, and per take of a message whose
--     publisher is not traced
CREATE OR REPLACE MACRO derive.flow_root(only_run) AS TABLE
WITH called AS (
    SELECT run_id, publication_id, publisher_id, caller_id, take_id, route
    FROM store.flow_call
    WHERE run_id = only_run
),
caller AS (
    SELECT DISTINCT called_key // 8 AS callback_instance_id
    FROM derive.flow_caller
    WHERE derive.vertex_kind(called_key) = 'callback_instance'
),
-- Each publication, and once more for each cause that it has. They are grouped, not joined: what a
-- join looks up stays in memory until the query ends.
cause AS (
    SELECT
        run_id, publication_id, publisher_id,
        false AS is_message,
        NULL::BIGINT AS callback_instance_id
    FROM store.publication
    WHERE run_id = only_run
    UNION ALL
    SELECT
        l.run_id, l.publication_id, l.publisher_id,
        l.take_id IS NOT NULL,
        CASE WHEN l.take_id IS NULL THEN l.callback_instance_id END
    FROM derive.certain_cause AS l
    WHERE l.run_id = only_run
        -- Not a join either: DuckDB would keep the links for it, which are far more.
        AND (
            SELECT c.callback_instance_id
            FROM caller AS c
            WHERE c.callback_instance_id = l.callback_instance_id
        ) IS NULL
    UNION ALL
    SELECT
        run_id, publication_id, publisher_id,
        take_id IS NOT NULL,
        CASE WHEN take_id IS NULL THEN caller_id END
    FROM called
),
root AS (
    SELECT
        c.run_id, c.publication_id, c.publisher_id,
        bool_or(c.is_message) AS is_message,
        any_value(p.topic_name) LIKE '%/\_action/status' ESCAPE '\' AS is_status,
        CASE WHEN NOT bool_or(c.is_message) THEN min(c.callback_instance_id) END
            AS callback_instance_id
    FROM cause AS c
    JOIN store.publisher AS p ON c.publisher_id = p.publisher_id
    WHERE NOT p.is_internal
    GROUP BY c.run_id, c.publication_id, c.publisher_id
),
way AS (
    SELECT
        publication_id, caller_id,
        min(route) AS route
    FROM called
    WHERE take_id IS NULL
    GROUP BY publication_id, caller_id
)
SELECT
    r.run_id, r.publication_id, r.publisher_id,
    NOT r.is_message AND (w.route IS NOT NULL OR r.is_status IS NOT TRUE) AS is_source,
    CASE WHEN r.callback_instance_id IS NULL THEN 'publication' ELSE 'callback_instance' END
        AS root_kind,
    coalesce(r.callback_instance_id, r.publication_id) AS root_id,
    coalesce(w.route, []::BIGINT[]) AS route,
    NULL::BIGINT AS before_take_ns
FROM root AS r
LEFT JOIN way AS w ON r.publication_id = w.publication_id AND r.callback_instance_id = w.caller_id
UNION ALL
SELECT
    o.run_id,
    -o.take_id,
    -o.subscription_id,
    o.subscription_id NOT IN (SELECT subscription_id FROM derive.goal_state_subscription),
    'take',
    o.take_id,
    []::BIGINT[],
    CASE
        WHEN min(t.taken_ns - t.source_timestamp_ns) OVER (PARTITION BY o.subscription_id)
            BETWEEN -derive.delivery_limit().stamp_slack_ns AND derive.delivery_limit().longest_ns
            THEN t.taken_ns - t.source_timestamp_ns
        ELSE 0
    END
FROM store.orphan_take AS o
JOIN store.take AS t ON o.take_id = t.take_id
JOIN store.subscription AS s ON o.subscription_id = s.subscription_id
WHERE o.run_id = only_run
    AND o.reason IN ('publisher_not_traced', 'publisher_without_events')
    AND NOT s.is_internal

-- description: Instances of the callbacks of subscriptions that are inputs of annotations. Where no
--     callback of the subscription was traced (rclpy), its takes stand for them: each is over as
--     soon as it began, and has the negative of its identity.
-- grain: one row per instance of such a callback, or take
CREATE OR REPLACE MACRO derive.annotated_run(only_run) AS TABLE
WITH instance AS (
    SELECT
        i.run_id,
        coalesce(c.subscription_id, t.subscription_id) AS subscription_id,
        i.callback_instance_id, i.trace_id, i.thread_id, i.start_ns, i.start_event_id,
        i.effective_end_event_id
    FROM store.callback_instance AS i
    JOIN store.callback AS c ON i.callback_id = c.callback_id
    LEFT JOIN store.take AS t
        ON c.subscription_id IS NULL AND i.take_id = t.take_id AND i.run_id = t.run_id
    WHERE i.run_id = only_run
        AND coalesce(c.subscription_id, t.subscription_id) IN (
            SELECT subscription_id FROM store.annotation_input WHERE run_id = only_run
        )
)
FROM instance
UNION ALL
SELECT
    t.run_id, t.subscription_id,
    -t.take_id,
    t.trace_id, t.thread_id, t.taken_ns, t.start_event_id, t.start_event_id
FROM store.take AS t
WHERE t.run_id = only_run
    AND t.subscription_id IN (
        SELECT subscription_id FROM store.annotation_input WHERE run_id = only_run
    )
    AND t.subscription_id NOT IN (SELECT subscription_id FROM instance)

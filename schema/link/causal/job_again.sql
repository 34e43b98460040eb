-- description: Publications of jobs of Python that go on and on: a thread, or a timer of it, that a
--     callback started publishes again, after a callback of its node that published nothing. It may
--     use the message of that one. What it published first likewise. A callback may start several
--     jobs: each goes on by itself, and with what it starts in turn.
-- grain: one row per such publication
CREATE OR REPLACE MACRO derive.job_again(only_run) AS TABLE
WITH job AS MATERIALIZED (
    SELECT
        b.publication_id, b.publisher_id, b.start_event_id, p.node_id, i.step_event_id,
        f.start_event_id AS begin_event_id,
        lag(b.start_event_id) OVER (
            PARTITION BY i.step_event_id, b.publisher_id ORDER BY b.start_event_id
        ) AS before_event_id
    FROM store.callback_instance AS i
    JOIN store.callback_instance AS f ON i.continues_id = f.callback_instance_id
    JOIN store.publication AS b ON i.start_event_id = b.callback_event_id
    JOIN store.publisher AS p ON b.publisher_id = p.publisher_id
    WHERE i.run_id = only_run AND f.run_id = only_run AND b.run_id = only_run
        AND i.thread_id NOT IN (
            SELECT thread_id FROM store.executor_thread WHERE run_id = only_run
        )
),
idle AS (
    SELECT s.node_id, i.start_event_id
    FROM store.callback_instance AS i
    JOIN store.callback AS c ON i.callback_id = c.callback_id
    JOIN store.subscription AS s ON c.subscription_id = s.subscription_id
    ANTI JOIN (FROM store.publication WHERE run_id = only_run) AS b
        ON i.start_event_id = b.callback_event_id
    ANTI JOIN (FROM store.callback_instance WHERE run_id = only_run) AS f
        ON i.callback_instance_id = f.continues_id
    WHERE i.run_id = only_run AND NOT s.is_internal
        AND s.node_id IN (SELECT node_id FROM job WHERE before_event_id IS NOT NULL)
),
behind AS (
    SELECT
        j.publication_id, j.step_event_id, j.publisher_id, j.before_event_id,
        i.start_event_id > coalesce(j.before_event_id, j.begin_event_id) AS is_behind
    FROM job AS j
    ASOF JOIN idle AS i ON j.node_id = i.node_id AND j.start_event_id > i.start_event_id
)
SELECT publication_id
FROM behind
WHERE is_behind
QUALIFY bool_or(before_event_id IS NOT NULL) OVER (PARTITION BY step_event_id, publisher_id)

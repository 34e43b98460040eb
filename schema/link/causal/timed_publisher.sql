-- description: Publishers that a timer explains, among those that seem to answer takes without a
--     callback. What a timer publishes comes when it is due, or as soon as the callback ends that
--     kept it waiting. So nearly all comes after a moment, since the take, when the timer was due,
--     and within a period before the thread takes its next message: else the timer would have
--     published again. Answers that take nearly a period follow such a moment by chance, but not
--     all of them do. Where a timer waits for several callbacks, it was due before the last take:
--     derive.answer_doubtful finds the period that its publications keep. In a thread that falls
--     behind they keep none, and follow the takes like answers. There it is a timer if it was due
--     since the publication before, nearly each time, and hardly more often, while more than a
--     tenth of the messages have no answer.
--     A timer is due at its initialisation plus whole periods. Executors of rclpy initialise a
--     timer for every wait that may time out: the first of each period stands for all.
-- grain: one row per publisher and period of a timer of its process that explains it
-- param: followers VARCHAR  Name of rows of publisher_id, process_id, start_ns, delay_ns (since the
--     take), rest_ns (until the next take; NULL: none), interval_ns and message_count (since the
--     publisher's publication before)
CREATE OR REPLACE MACRO derive.timed_publisher(only_run, followers) AS TABLE
WITH timer AS (
    SELECT
        process_id, period_ns,
        min(created_ns) AS created_ns
    FROM store.timer
    WHERE run_id = only_run AND period_ns > 0
    GROUP BY process_id, period_ns
),
late AS (
    SELECT
        f.publisher_id, f.delay_ns, t.period_ns, f.message_count,
        (f.start_ns - t.created_ns) % t.period_ns AS late_ns,
        (f.start_ns - t.created_ns) // t.period_ns
            - (f.start_ns - f.interval_ns - t.created_ns) // t.period_ns AS times_due,
        coalesce(f.rest_ns <= t.period_ns, true) AS ends_in_period
    FROM (
        SELECT
            *,
            min(start_ns) OVER (PARTITION BY publisher_id) AS first_ns
        FROM query_table(followers)
    ) AS f
    JOIN timer AS t ON f.process_id = t.process_id AND t.created_ns < f.first_ns
),
explained AS (
    SELECT
        publisher_id,
        count(*) AS publication_count,
        count(CASE WHEN ends_in_period AND late_ns <= delay_ns THEN 1 END) AS due_count,
        -- So many would come after such a moment without any timer.
        sum(CASE WHEN ends_in_period THEN least(delay_ns, period_ns) / period_ns ELSE 0 END)
            AS chance_count,
        avg(message_count) > 1.1
        AND count_if(times_due > 0) > 0.95 * count(times_due)
        AND count(times_due) > 0.8 * sum(times_due) AS is_late
    FROM late
    GROUP BY publisher_id, period_ns
)
SELECT publisher_id
FROM explained
WHERE is_late OR due_count - chance_count >= 0.8 * (publication_count - chance_count)

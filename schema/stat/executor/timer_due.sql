-- description: When timers were due: at whole numbers of periods after their creation, at the
--     first of these moments after the previous call. No event tells that a timer was reset,
--     cancelled for a while, or runs on simulated time. So a moment is only known where half of the
--     ten calls before and half of the ten after, each with the call itself, keep the grid: they
--     are punctual (late by a millisecond at most, or by a tenth of the period if that is less), or
--     the executor ran callbacks for half of the time by which they are late. It is also known
--     between two calls around which half are punctual. Until Humble timers read another clock than
--     the tracer, and the two drift apart: the grid follows punctual calls, from second to second
--     (from ten periods to the next, of slow timers). Calls show it as well that come sooner than a
--     period after the call before, as only after a late one, if they are a tenth of the period
--     apart in their slots of the grid: where they are not, the timer keeps another grid. Where
--     more calls come at once than were due, they make up for those that did not come before: an
--     events executor queues calls, and each has a moment of its own.
-- grain: one row per call of a timer whose due moment is known
-- param: executors VARCHAR  Name of rows with executors (executor_id): timers of their runs
CREATE OR REPLACE MACRO derive.timer_due(executors) AS TABLE
WITH RECURSIVE call AS MATERIALIZED (
    SELECT
        i.callback_id, i.callback_instance_id, x.executor_id, i.start_ns, t.period_ns, t.created_ns,
        e.kind IS DISTINCT FROM 'single_threaded' AS may_queue,
        (i.start_ns - t.created_ns) // greatest(10 * t.period_ns, 1000000000) AS slice,
        -- What waking takes, and clocks drift in a period.
        least(t.period_ns // 10, 1000000 + t.period_ns // 10000) AS slack_ns,
        row_number() OVER of_calls AS number,
        lag(i.start_ns) OVER of_calls AS previous_ns,
        -- Of lag with an offset, older versions of DuckDB cannot read the definition.
        any_value(i.start_ns) OVER (of_calls ROWS BETWEEN 2 PRECEDING AND 2 PRECEDING)
            AS earlier_ns
    FROM store.callback_instance AS i
    JOIN store.callback AS c ON i.callback_id = c.callback_id
    JOIN store.timer AS t ON c.timer_id = t.timer_id
    LEFT JOIN store.executor_thread AS x ON i.thread_id = x.thread_id
    LEFT JOIN store.executor AS e ON x.executor_id = e.executor_id
    WHERE t.period_ns > 0 AND t.created_ns IS NOT NULL AND t.run_id IN (
        SELECT run_id
        FROM store.executor
        WHERE executor_id IN (SELECT executor_id FROM query_table(executors))
    )
    WINDOW of_calls AS (PARTITION BY i.callback_id ORDER BY i.start_ns, i.callback_instance_id)
),
slice AS MATERIALIZED (
    SELECT
        callback_id, slice,
        any_value(period_ns) AS period_ns,
        any_value(slack_ns) AS slack_ns,
        lead(slice) OVER (PARTITION BY callback_id ORDER BY slice) AS next_slice,
        list(start_ns - created_ns) AS ages
    FROM call
    GROUP BY callback_id, slice
),
-- By how much the grid has moved, and how late punctual calls were at first.
followed AS (
    SELECT
        callback_id,
        NULL::BIGINT AS slice,
        min(slice) AS next_slice,
        0::BIGINT AS moved_ns,
        NULL::BIGINT AS usual_ns
    FROM slice
    GROUP BY callback_id
    UNION ALL
    SELECT
        callback_id, slice, next_slice,
        CASE
            WHEN late[2] - late[1] <= slack_ns AND abs(late[1] - usual_ns) <= slack_ns THEN
                -- Without a drift the difference is this small, and the grid stays exact.
                CASE WHEN abs(followed_ns) > slack_ns // 10 THEN followed_ns ELSE 0 END
            ELSE moved_ns
        END,
        coalesce(usual_ns, CASE WHEN late[2] - late[1] <= slack_ns THEN late[1] END)
    FROM (
        SELECT
            *,
            moved_ns + greatest(least(late[1] - usual_ns, drift_ns), -drift_ns) AS followed_ns
        FROM (
            SELECT
                f.callback_id, s.slice, s.next_slice, s.slack_ns, f.moved_ns, f.usual_ns,
                -- Clocks drift by less than 100 ppm.
                greatest(10 * s.period_ns, 1000000000) // 10000 AS drift_ns,
                (
                    SELECT quantile_disc(
                        (age_ns - f.moved_ns + s.slack_ns) % s.period_ns - s.slack_ns, [0.1, 0.5]
                    )
                    FROM (SELECT unnest(s.ages) AS age_ns)
                ) AS late
            FROM followed AS f
            JOIN slice AS s ON f.callback_id = s.callback_id AND f.next_slice = s.slice
        )
    )
),
-- Its creation is recorded a little later than the instant from which the periods count: a
-- hundredth of the period is allowed for that.
placed AS (
    SELECT
        c.callback_id, c.callback_instance_id, c.executor_id, c.number, c.start_ns, c.period_ns,
        c.slack_ns, c.previous_ns, c.may_queue,
        c.created_ns + f.moved_ns AS origin_ns,
        -- Where the grid follows late calls, it is behind for a while.
        (c.start_ns - origin_ns + c.period_ns // 10) // c.period_ns AS own_slot,
        (c.previous_ns - origin_ns + c.period_ns // 100) // c.period_ns AS slot,
        (c.earlier_ns - origin_ns + c.period_ns // 100) // c.period_ns AS earlier_slot
    FROM call AS c
    JOIN followed AS f ON c.callback_id = f.callback_id AND c.slice = f.slice
),
-- How many calls more than slots there were by then, at the most before and after a call.
ahead AS (
    SELECT
        *,
        own_slot - lag(own_slot) OVER of_slots AS slots,
        max(number - own_slot) OVER (of_slots ROWS UNBOUNDED PRECEDING) AS ahead_before,
        max(number - own_slot) OVER (of_slots ROWS BETWEEN CURRENT ROW AND UNBOUNDED FOLLOWING)
            AS ahead_after
    FROM placed
    WINDOW of_slots AS (PARTITION BY callback_id ORDER BY number)
),
-- A call shortly before an instant of the grid was for that instant, or for the one before it,
-- almost a period late. In the second case the instant is still to come.
due AS (
    SELECT
        callback_id, callback_instance_id, executor_id, number, start_ns, period_ns, slack_ns,
        previous_ns, slots,
        origin_ns + period_ns * CASE
            WHEN previous_ns < origin_ns + period_ns * slot
                AND coalesce(earlier_slot, 0) + 1 < slot
                THEN slot
            ELSE slot + 1
        END AS next_ns,
        CASE
            WHEN may_queue AND ahead_before >= ahead_after
                THEN origin_ns + period_ns * (number - ahead_after)
        END AS queued_ns,
        CASE
            WHEN queued_ns < previous_ns THEN queued_ns
            WHEN next_ns <= start_ns THEN next_ns
            WHEN next_ns - start_ns <= period_ns // 100 THEN start_ns
            WHEN next_ns - period_ns > previous_ns THEN next_ns - period_ns
        END AS due_ns
    FROM ahead
),
-- Up to when the threads of an executor had run callbacks, on average, for how long.
ran AS MATERIALIZED (
    SELECT
        r.executor_id, r.end_ns,
        r.end_ns - r.start_ns AS last_ns,
        sum((r.end_ns - r.start_ns) / s.thread_count) OVER (
            PARTITION BY r.executor_id ORDER BY r.end_ns
        ) AS ran_ns
    FROM derive.executor_run AS r
    JOIN derive.executor_size AS s ON r.executor_id = s.executor_id
    WHERE r.executor_id IN (SELECT executor_id FROM due)
),
kept AS (
    SELECT
        d.callback_id, d.callback_instance_id, d.number, d.start_ns, d.due_ns,
        CASE WHEN d.due_ns < d.previous_ns THEN d.due_ns ELSE d.previous_ns + d.period_ns END
            AS latest_ns,
        d.period_ns,
        d.slots,
        CASE
            WHEN d.slots = 1 AND d.start_ns - d.previous_ns < d.period_ns - d.slack_ns
                THEN d.start_ns - d.due_ns
        END AS sooner_ns,
        (d.start_ns - d.due_ns <= d.slack_ns)::INTEGER AS is_punctual,
        coalesce(d.start_ns - d.due_ns <= greatest(
            d.slack_ns, 2 * s.last_ns, 2 * (s.ran_ns - coalesce(b.ran_ns, 0))
        ), false)::INTEGER AS is_kept
    FROM due AS d
    ASOF LEFT JOIN ran AS b ON d.executor_id = b.executor_id AND d.due_ns >= b.end_ns
    ASOF LEFT JOIN ran AS s ON d.executor_id = s.executor_id AND d.start_ns >= s.end_ns
    WHERE d.due_ns IS NOT NULL
),
around AS (
    SELECT
        callback_id, callback_instance_id, number, due_ns, latest_ns,
        least(avg(is_kept) OVER behind, avg(is_kept) OVER ahead) >= 0.5 AS is_kept,
        (
            avg(is_punctual) OVER behind >= 0.5
            OR max(sooner_ns) OVER behind - min(sooner_ns) OVER behind > period_ns // 10
            AND min(slots) OVER behind > 0
        )
        AND (
            avg(is_punctual) OVER ahead >= 0.5
            OR max(sooner_ns) OVER ahead - min(sooner_ns) OVER ahead > period_ns // 10
            AND min(slots) OVER ahead > 0
        ) AS is_certain
    FROM kept
    WINDOW
        of_grid AS (PARTITION BY callback_id ORDER BY number),
        behind AS (of_grid ROWS BETWEEN 10 PRECEDING AND CURRENT ROW),
        ahead AS (of_grid ROWS BETWEEN CURRENT ROW AND 10 FOLLOWING)
)
SELECT callback_instance_id, due_ns, latest_ns
FROM around
WINDOW in_time AS (PARTITION BY callback_id ORDER BY number)
QUALIFY is_kept
    OR bool_or(is_certain) OVER (in_time ROWS UNBOUNDED PRECEDING)
    AND bool_or(is_certain) OVER (in_time ROWS BETWEEN CURRENT ROW AND UNBOUNDED FOLLOWING)

#!/usr/bin/env perl
# A manager in Perl: searches as high as the visibility allows, and recovers failed thrusters.
use strict;
use warnings;
use JSON::PP;

$| = 1;
my (%task, $failed);
while (my $line = <STDIN>) {
    my $message = decode_json($line);
    my ($type, $answer) = ($message->{type}, {});
    if ($type eq 'mission_started') {
        (%task, $failed) = ();
        $answer = {
            protocol => 1, period_s => 2.0,
            subscribes_to => ['component_status'],
            depends_on => { water_visibility => [2.25, 3.25] },
        };
    } elsif ($type eq 'task_requested') {
        $task{$_} = 1 for @{ $message->{functions} };
    } elsif ($type eq 'task_cancelled') {
        delete @task{ @{ $message->{functions} } };
    } elsif ($type eq 'diagnostic') {
        $failed = $message->{value} eq 'FALSE';
    } elsif ($type eq 'adapt') {
        my $visibility = $message->{measured}{water_visibility} // 0;
        my $height = $visibility >= 3.25 ? 'high' : $visibility >= 2.25 ? 'medium' : 'low';
        $answer->{modes}{f_generate_search_path} = "fd_spiral_$height" if $task{f_generate_search_path};
        $answer->{modes}{f_follow_pipeline} = 'fd_follow_pipeline' if $task{f_follow_pipeline};
        $answer->{modes}{f_maintain_motion} = $failed ? 'fd_recover_thrusters' : 'fd_all_thrusters';
    }
    print encode_json($answer), "\n";
}

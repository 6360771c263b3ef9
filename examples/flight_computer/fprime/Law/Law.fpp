module Cubli {

  @ The body of an attitude, a command or a funnel: one message
  port Body(ref data: Fw.Buffer)

  @ The rover's attitude law: answers each attitude in the caller's thread, as a rate group or a driver calls it
  passive component Law {

    @ One attitude
    sync input port attitude: Body

    @ The torques that answer it
    output port command: Body

    @ What the law sees of itself
    output port funnel: Body

    @ The law has stopped; nothing more is commanded
    event Stopped(fault: I32) severity fatal format "The law has stopped: fault {}"

    @ An attitude of a wrong length was not answered
    event WrongLength($size: FwSizeType) severity warning high format "An attitude of {} bytes is not answered"

    event port events
    text event port textEvents
    time get port times
  }
}
